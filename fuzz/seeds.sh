#!/bin/sh
# Writes small valid files of every mesh format: seeds.sh DIRECTORY gives DIRECTORY/obj/..., stl/, ply/, off/, scene/.
set -eu
out=${1:?usage: seeds.sh DIRECTORY}
mkdir -p "$out/obj" "$out/stl" "$out/ply" "$out/off"

# A tetrahedron, as text rows.
points='0 0 0
1 0 0
0 1 0
0 0 1'
faces='0 2 1
0 1 3
0 3 2
1 2 3'

{ echo '# tetrahedron'; echo "$points" | sed 's/^/v /'; printf 'f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n'; } >"$out/obj/plain.obj"
printf 'mtllib a.mtl\r\no a\r\nv 0 0 0 1\r\nv 1. 0 0\r\nv 1 1 0 .5 .5 .5\r\nv +0 1e0 0\r\nvt 0 0\r\nvn 0 0 1\r\nf 1/1/1 2/1/1 3/1/1 4/1/1\r\nf -4//1 \\\r\n -2//-1 -1//1\r\n' >"$out/obj/features.obj"
printf 'f 1/1 2/1 3/1\nv 0 0 0\nv 1 0 0\nv 0 1 0\ns off\ng b\nl 1 2\n' >"$out/obj/forward.obj"

{ echo OFF; echo '4 4 6'; echo "$points"; echo "$faces" | sed 's/^/3 /'; } >"$out/off/plain.off"
printf 'COFF 4 1 0 # counts\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n\n1 1 0 1 1 1 1\n0 1 0 0 0 0 0\n4 0 1 2 3 0.5 0.5 0.5\n' >"$out/off/colour.off"
printf 'STCNOFF\n# comment\n3 1\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1e-3 0 0 0 1\n3 0 1 2\n' >"$out/off/normals.off"

facet='facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n'
printf "solid a b\n${facet}${facet}endsolid a b\n" >"$out/stl/text.stl"
printf "solid\n${facet}endsolid\nSOLID c\n${facet}endsolid c\n" >"$out/stl/two.stl"
row='\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0\0\0\0\0\0\0\0\0\0\0\200?\0\0\0\0\0\0'
{ printf 'solid %74s\1\0\0\0' ''; printf "$row"; } >"$out/stl/one.stl"
{ printf '%80s\2\0\0\0' ''; printf "$row$row"; } >"$out/stl/two_binary.stl"

header='element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n'
{ printf "ply\nformat ascii 1.0\ncomment c\n$header"; echo "$points"; echo "$faces" | sed 's/^/3 /'; } >"$out/ply/ascii.ply"
{
    printf 'ply\nformat ascii 1.0\nobj_info i\nelement face 1\nproperty uchar red\nproperty list uint8 uint16 vertex_index\nelement edge 1\nproperty int a\n'
    printf 'element vertex 3\nproperty float64 z\nproperty list int8 short w\nproperty float32 y\nproperty int16 x\nend_header\n9 3 0 1 2\n7\n0 0 1 2\n0 2 5 6 1 2\n1 1 4 3 -3\n'
} >"$out/ply/order.ply"
zero='\0\0\0\0'
{
    printf "ply\nformat binary_little_endian 1.0\n$header"
    one='\0\0\200?'
    printf "$zero$zero$zero$one$zero$zero$zero$one$zero$zero$zero$one"
    printf '\3\0\0\0\0\2\0\0\0\1\0\0\0\3\0\0\0\0\1\0\0\0\3\0\0\0\3\0\0\0\0\3\0\0\0\2\0\0\0\3\1\0\0\0\2\0\0\0\3\0\0\0'
} >"$out/ply/little.ply"
{
    printf "ply\nformat binary_big_endian 1.0\n$header"
    one='?\200\0\0'
    printf "$zero$zero$zero$one$zero$zero$zero$one$zero$zero$zero$one"
    printf '\3\0\0\0\0\0\0\0\2\0\0\0\1\3\0\0\0\0\0\0\0\1\0\0\0\3\3\0\0\0\0\0\0\0\3\0\0\0\2\3\0\0\0\1\0\0\0\2\0\0\0\3'
} >"$out/ply/big.ply"
{
    printf 'ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty uchar x\nproperty char y\nproperty short z\n'
    printf 'element face 1\nproperty list uchar uchar vertex_index\nproperty list uchar float uv\nend_header\n'
    printf '\0\0\0\0\1\0\0\0\1\1\0\0\0\1\0\0\4\0\1\2\3\1\0\0\0\0'
} >"$out/ply/bytes.ply"

mkdir -p "$out/scene"
cat >"$out/scene/full.toml" <<'SCENE'
mesh = "liver.stl"
unit = "mm"
normalize = false
weld = 0.1
[material]
name = "liver"
young_pa = 5500
surface_ratio = 0.1
[body]
scheme = "C"
centre = [0.0, 1.5, -2]
free = true
[simulation]
gravity_m_s2 = [0, -9.81, 0]
duration_s = 2.0
dt_s = 1e-2
integrator = "implicit"
precision = "double"
every = 5
[[force]]
name = 'a "b"'
vertex = 3
newton = [0, 0, 1.0]
profile = [[0, 0], [1.0, 2]]
[[force]]
near = [1, 2, 3]
inward = 0.01
radius = 0.4
start = 0.1
end = 1
ramp = 0.2
[[pin]]
vertices = [1, 2]
path = [[0, 0, 0, 0], [1, 0.1, 0, 0]]
[[tool]]
radius = 0.1
length = 0.2
axis = [0, 1, 0]
friction = 0.5
path = [[0, 0, 0, 2], [1, 0, 0, 1]]
[[tool]]
normal = [0, 1, 0]
at = [0, -1, 0]
SCENE
printf 'mesh = "sphere:vertices=100"\n' >"$out/scene/short.toml"
printf '[material]\ndensity_kg_m3 = 1050.0\n[simulation]\nequilibrium = true\nresidual_n = 1e-9\n' >"$out/scene/more.toml"
