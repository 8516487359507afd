// A first-in-first-out queue of fixed capacity for one thread; allocates at construction only.
#pragma once

#include <cstddef>
#include <vector>

#include "io/archive.h"

namespace shiftrig::io::can {

template <class T>
class Ring {
  public:
    explicit Ring(std::size_t capacity) : items_(capacity) {}
    bool empty() const noexcept { return count_ == 0; }
    bool full() const noexcept { return count_ == items_.size(); }
    std::size_t size() const noexcept { return count_; }
    bool push(const T& item) noexcept {
        if (full()) return false;
        items_[(first_ + count_) % items_.size()] = item;
        ++count_;
        return true;
    }
    const T& front() const noexcept { return items_[first_]; }
    void pop() noexcept {
        first_ = (first_ + 1) % items_.size();
        --count_;
    }
    template <class Predicate>
    bool any(Predicate predicate) const noexcept {
        for (std::size_t i = 0; i < count_; ++i)
            if (predicate(items_[(first_ + i) % items_.size()])) return true;
        return false;
    }
    void clear() noexcept { first_ = count_ = 0; }

    // Only the items that are in it.
    void archive(Archive& a) {
        std::size_t count = count_;
        a(count);
        if (a.restoring()) clear();
        for (std::size_t i = 0; i < count; ++i) {
            T item = a.restoring() ? T{} : items_[(first_ + i) % items_.size()];
            a(item);
            if (a.restoring()) push(item);
        }
    }

  private:
    std::vector<T> items_;
    std::size_t first_ = 0, count_ = 0;
};

}  // namespace shiftrig::io::can
