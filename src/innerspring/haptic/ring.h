#pragma once
#include <atomic>
#include <type_traits>
#include <vector>

namespace innerspring {

/// A queue from one thread to another: neither waits. What finds no room is dropped and counted.
template <class T>
class Ring {
    static_assert(std::is_trivially_destructible_v<T>);  // numbers: copying them allocates nothing

  public:
    explicit Ring(std::size_t room) : items_(room + 1) {}

    bool push(const T& item) noexcept {  // writer
        const std::size_t at = head_.load(std::memory_order_relaxed), next = (at + 1) % items_.size();
        if (next == tail_.load(std::memory_order_acquire)) {
            dropped_.fetch_add(1, std::memory_order_relaxed);
            return false;
        }
        items_[at] = item;
        head_.store(next, std::memory_order_release);
        return true;
    }

    bool pop(T& item) noexcept {  // reader
        const std::size_t at = tail_.load(std::memory_order_relaxed);
        if (at == head_.load(std::memory_order_acquire)) return false;
        item = items_[at];
        tail_.store((at + 1) % items_.size(), std::memory_order_release);
        return true;
    }

    std::size_t dropped() const noexcept { return dropped_.load(std::memory_order_relaxed); }

  private:
    std::vector<T> items_;
    std::atomic<std::size_t> head_{0}, tail_{0}, dropped_{0};
};

}  // namespace innerspring
