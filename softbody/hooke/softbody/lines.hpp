// Memory that starts on a cache line. Internal to hooke::softbody and not installed.
#pragma once

#include <cstdint>
#include <vector>

namespace hooke::softbody {

template <class S>
class Lines {
 public:
  /// n zeros.
  void resize(std::size_t n) {
    memory_.assign(n + 64 / sizeof(S), S(0));
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
    data_ = memory_.data() + (64 - address % 64) % 64 / sizeof(S);
  }
  S* data() const { return data_; }
  bool empty() const { return memory_.empty(); }

 private:
  std::vector<S> memory_;
  S* data_ = nullptr;
};

}  // namespace hooke::softbody
