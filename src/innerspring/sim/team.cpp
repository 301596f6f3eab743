#include "innerspring/sim/team.h"

#include <algorithm>

namespace innerspring {

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

void Team::share(std::size_t rank) const {
    const std::size_t n = workers_.size() + 1;
    for (std::size_t block = blocks_ * rank / n; block < blocks_ * (rank + 1) / n; ++block)
        call_(loop_, block);
}

void Team::work(std::size_t rank) {
    unsigned seen = 0;
    for (;;) {
        // Work comes again within microseconds during a run: look for it a while before going to sleep.
        for (int spin = 0; spin < 2000 && round_.load(std::memory_order_acquire) == seen; ++spin)
            std::this_thread::yield();
        round_.wait(seen, std::memory_order_acquire);
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
         left = busy_.load(std::memory_order_acquire)) {
        for (int spin = 0; spin < 2000 && busy_.load(std::memory_order_acquire) == left; ++spin)
            std::this_thread::yield();
        busy_.wait(left, std::memory_order_acquire);
    }
}

}  // namespace innerspring
