// Threads that work on one thing together.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>
#include <vector>

namespace hooke {

/// A few threads that run at the same time, so that they may wait for each other: what a thread pool does
/// not promise. Between calls they spin for a fraction of a millisecond, then sleep.
class Gang {
 public:
  /// @param size threads, the caller's among them; >= 1
  explicit Gang(int size);
  ~Gang();
  Gang(const Gang&) = delete;
  Gang& operator=(const Gang&) = delete;

  int size() const { return int(threads_.size()) + 1; }

  /// Calls work(i) for every i in [0, size()), each on a thread of its own, and returns when all are done.
  /// `work` must not throw. Not to be called from two threads at once.
  void run(const std::function<void(int)>& work);

 private:
  void serve(int index);

  const std::function<void(int)>* work_ = nullptr;
  std::atomic<std::uint32_t> call_{0};
  std::atomic<int> busy_{0};
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

/// Waits until value >= wanted, for as short a time as others need to come to a point in the same loop.
inline void wait_for(const std::atomic<int>& value, int wanted) {
  for (int i = 0; value.load(std::memory_order_acquire) < wanted; ++i)
    // Where threads outnumber processors, the one that is waited for must get its turn.
    if (i > 1'000) std::this_thread::yield();
}

}  // namespace hooke
