// A stand-in for Force Dimension's libdhd.so: the same C interface, a stylus that stays where it is put, and
// errors on demand. Nothing of innerspring is linked into it.
#include <atomic>
#include <cstring>
#include <string_view>

namespace {

struct Stub {
    std::atomic<int> calls{0}, fail_call{-1};
    std::atomic<int> open{0}, motors{0};
    double x[3]{}, v[3]{}, f[3]{};
} stub;

/// Each call comes by here; what it gives back.
int call(int good = 0) {
    return stub.calls++ == stub.fail_call ? -1 : good;
}

int three(const double* from, double* a, double* b, double* c) {
    const int result = call();
    if (result >= 0) *a = from[0], *b = from[1], *c = from[2];
    return result;
}

}  // namespace

extern "C" {

int dhdOpen() {
    const int id = call();
    stub.open += id >= 0;
    return id;
}
int dhdClose(char) {
    --stub.open;
    return call();
}
int dhdEnableForce(unsigned char on, char) {
    const int result = call();
    if (result >= 0) stub.motors = on;
    return result;
}
int dhdGetPosition(double* x, double* y, double* z, char) {
    return three(stub.x, x, y, z);
}
int dhdGetLinearVelocity(double* x, double* y, double* z, char) {
    return three(stub.v, x, y, z);
}
int dhdGetOrientationFrame(double m[3][3], char) {
    const double turn[3][3] = {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};  // about z, a quarter
    std::memcpy(m, turn, sizeof turn);
    return call(1);  // 1: the last value again
}
unsigned dhdGetButtonMask(char) {
    return 2;
}
int dhdSetForce(double x, double y, double z, char) {
    stub.f[0] = x, stub.f[1] = y, stub.f[2] = z;
    return call();
}
const char* dhdGetSystemName(char) {
    return "Stub omega";
}
const char* dhdErrorGetLastStr() {
    return "stub error";
}

// The test's side.
void stub_set(const char* name, double a, double b, double c) {
    const std::string_view key(name);
    if (key == "fail_call") stub.fail_call = int(a), stub.calls = 0;
    if (key == "x") stub.x[0] = a, stub.x[1] = b, stub.x[2] = c;
    if (key == "v") stub.v[0] = a, stub.v[1] = b, stub.v[2] = c;
}
double stub_get(const char* name) {
    const std::string_view key(name);
    if (key == "calls") return stub.calls;
    if (key == "open") return stub.open;
    if (key == "motors") return stub.motors;
    if (key == "fx") return stub.f[0];
    if (key == "fy") return stub.f[1];
    if (key == "fz") return stub.f[2];
    return -1;
}
}
