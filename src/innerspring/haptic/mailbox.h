#pragma once
#include <array>
#include <atomic>

namespace innerspring {

/// The newest value from one thread to another, by three copies that change hands: neither side waits, what
/// was not read is overwritten.
template <class T>
class Mailbox {
  public:
    void send(const T& value) noexcept {  // writer
        slots_[back_] = value;
        back_ = middle_.exchange(back_ | fresh, std::memory_order_acq_rel) & index;
    }

    /// True if something newer has come; `latest()` is then that.
    bool update() noexcept {  // reader
        if (!(middle_.load(std::memory_order_relaxed) & fresh)) return false;
        front_ = middle_.exchange(front_, std::memory_order_acq_rel) & index;
        return true;
    }
    const T& latest() const noexcept { return slots_[front_]; }  // reader

  private:
    static constexpr unsigned fresh = 4, index = 3;
    std::array<T, 3> slots_{};
    unsigned back_ = 0, front_ = 1;
    std::atomic<unsigned> middle_{2};
};

}  // namespace innerspring
