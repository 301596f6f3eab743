#include "innerspring/mesh/team.h"

#include <algorithm>
#include <utility>

namespace innerspring {

namespace {

/// Work comes again within microseconds during a run: looks for it a while, gives way a while, and then
/// sleeps until the value is another one.
template <class Number>
void wait_while(const std::atomic<Number>& value, Number old) {
    for (int n = 0; n < 500; ++n) {
        if (value.load(std::memory_order_acquire) != old) return;
        if (n >= 300) {
            std::this_thread::yield();
        } else {
#if defined(__x86_64__)
            __builtin_ia32_pause();
#endif
        }
    }
    value.wait(old, std::memory_order_acquire);
}

}  // namespace

Team::Team(int threads) {
    const int cores = std::max(1, int(std::thread::hardware_concurrency()));
    const int n = threads <= 0 ? cores : threads;
    for (int rank = 1; rank < n; ++rank) workers_.emplace_back([this, rank] { work(std::size_t(rank)); });
}

Team::~Team() {
    stop_ = true;
    ++round_;
    round_.notify_all();
    for (std::thread& worker : workers_) worker.join();
}

void Team::share(std::size_t rank) {
    const std::size_t n = workers_.size() + 1;
    try {
        for (std::size_t block = blocks_ * rank / n; block < blocks_ * (rank + 1) / n; ++block)
            call_(loop_, block);
    } catch (...) {
        if (!failed_.exchange(true)) error_ = std::current_exception();
    }
}

void Team::work(std::size_t rank) {
    unsigned seen = 0;
    for (;;) {
        wait_while(round_, seen);
        ++seen;
        if (stop_) return;
        share(rank);
        if (busy_.fetch_sub(1, std::memory_order_acq_rel) == 1) busy_.notify_one();
    }
}

void Team::run_erased(std::size_t blocks, void* loop, Call call) {
    blocks_ = blocks, loop_ = loop, call_ = call;
    if (workers_.empty() || blocks < 2) {
        for (std::size_t block = 0; block < blocks; ++block) call(loop, block);
        return;
    }
    busy_.store(unsigned(workers_.size()), std::memory_order_relaxed);
    round_.fetch_add(1, std::memory_order_release);
    round_.notify_all();
    share(0);
    for (unsigned left = busy_.load(std::memory_order_acquire); left != 0;
         left = busy_.load(std::memory_order_acquire))
        wait_while(busy_, left);
    if (failed_.exchange(false)) std::rethrow_exception(std::exchange(error_, nullptr));
}

}  // namespace innerspring
