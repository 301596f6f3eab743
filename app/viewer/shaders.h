#pragma once

namespace innerspring::viewer {

inline constexpr const char* surface_vertex_shader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in float value;
uniform mat4 view, view_projection;
out vec3 seen, facing;
out float shade_by;
void main() {
    seen = (view * vec4(position, 1)).xyz;
    facing = mat3(view) * normal;
    shade_by = value;
    gl_Position = view_projection * vec4(position, 1);
}
)";

inline constexpr const char* surface_fragment_shader = R"(#version 330 core
in vec3 seen, facing;
in float shade_by;
uniform float coloured;      // 1: by value; 0: base, lit; -1: base as it is
uniform float flat_shading;
uniform vec4 base;
uniform sampler2D map;
out vec4 colour;
void main() {
    if (coloured < -0.5) {
        colour = base;
        return;
    }
    vec3 n = flat_shading > 0.5 ? cross(dFdx(seen), dFdy(seen)) : facing;
    n = normalize(n);
    if (!gl_FrontFacing) n = flat_shading > 0.5 ? n : -n;
    // A light over the left shoulder, one from the right, and the eye's own.
    vec3 eye = normalize(-seen);
    float light = 0.44 + 0.46 * max(dot(n, normalize(vec3(-0.5, 0.8, 0.6))), 0.0)
                + 0.18 * max(dot(n, normalize(vec3(0.9, 0.1, 0.4))), 0.0) + 0.12 * max(dot(n, eye), 0.0);
    float gloss = pow(max(dot(n, normalize(normalize(vec3(-0.5, 0.8, 0.6)) + eye)), 0.0), 40.0);
    vec3 skin = coloured > 0.5 ? texture(map, vec2(clamp(shade_by, 0.002, 0.998), 0.5)).rgb : base.rgb;
    colour = vec4(skin * light + 0.12 * gloss, base.a);
}
)";

inline constexpr const char* line_vertex_shader = R"(#version 330 core
layout(location = 0) in vec3 position;
layout(location = 1) in vec4 paint;
uniform mat4 view_projection;
out vec4 tint;
void main() {
    tint = paint;
    gl_Position = view_projection * vec4(position, 1);
}
)";

inline constexpr const char* line_fragment_shader = R"(#version 330 core
in vec4 tint;
out vec4 colour;
void main() { colour = tint; }
)";

}  // namespace innerspring::viewer
