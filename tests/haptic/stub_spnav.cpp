// A stand-in for libspnav: the same C interface, and events that a test puts in. Nothing of innerspring is
// linked into it.
#include <cstring>
#include <deque>
#include <mutex>

namespace {

struct Motion {
    int type, x, y, z, rx, ry, rz;
    unsigned period;
    int* data;
};
struct Button {
    int type, press, number;
};
struct Stub {
    std::mutex lock;
    std::deque<Motion> events;  ///< a button: x and y are press and number
    bool daemon = true;
    int open = 0;
} stub;

}  // namespace

extern "C" {

int spnav_open() {
    const std::lock_guard lock(stub.lock);
    if (!stub.daemon) return -1;
    ++stub.open;
    return 0;
}
int spnav_close() {
    const std::lock_guard lock(stub.lock);
    --stub.open;
    return 0;
}
int spnav_poll_event(void* event) {
    const std::lock_guard lock(stub.lock);
    if (stub.events.empty()) return 0;
    Motion next = stub.events.front();
    stub.events.pop_front();
    if (next.type == 2) {
        const Button button{2, next.x, next.y};
        std::memcpy(event, &button, sizeof button);
    } else {
        std::memcpy(event, &next, sizeof next);
    }
    return next.type;
}

// The test's side.
void stub_event(int type, int x, int y, int z) {
    const std::lock_guard lock(stub.lock);
    stub.events.push_back({type, x, y, z, 0, 0, 0, 16, nullptr});
}
void stub_daemon(int there) {
    const std::lock_guard lock(stub.lock);
    stub.daemon = there != 0;
    stub.events.clear();
}
int stub_open() {
    const std::lock_guard lock(stub.lock);
    return stub.open;
}
}
