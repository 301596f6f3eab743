#pragma once
#include <atomic>
#include <cstddef>
#include <exception>
#include <thread>
#include <type_traits>
#include <vector>

namespace innerspring {

/// Threads that run the blocks of a loop. Which thread runs which block is fixed, and a loop body that only
/// writes its own block gives the same bits for any number of threads.
class Team {
  public:
    explicit Team(int threads);  ///< 0: all cores
    ~Team();
    Team(const Team&) = delete;
    Team& operator=(const Team&) = delete;

    int threads() const { return int(workers_.size()) + 1; }

    /// Calls loop(block) for every block in [0, blocks) and returns when all are done. What a call throws
    /// ends its thread's share and is thrown on here, the first of them.
    template <class Loop>
    void run(std::size_t blocks, Loop&& loop) {
        run_erased(blocks, const_cast<void*>(static_cast<const void*>(&loop)),
                   [](void* self, std::size_t block) {
                       (*static_cast<std::remove_reference_t<Loop>*>(self))(block);
                   });
    }

  private:
    using Call = void (*)(void*, std::size_t);
    void run_erased(std::size_t blocks, void* loop, Call call);
    void work(std::size_t rank);
    void share(std::size_t rank);

    std::vector<std::thread> workers_;
    std::atomic<unsigned> round_{0};
    std::atomic<unsigned> busy_{0};
    std::atomic<bool> stop_{false};
    std::atomic<bool> failed_{false};
    std::exception_ptr error_;
    std::size_t blocks_ = 0;
    void* loop_ = nullptr;
    Call call_ = nullptr;
};

/// Vertices in a block: small enough to share out, large enough to be worth a call. Sums over vertices go
/// block by block.
inline constexpr std::size_t block_size = 512;
inline std::size_t block_count(std::size_t n) {
    return (n + block_size - 1) / block_size;
}

}  // namespace innerspring
