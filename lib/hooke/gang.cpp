#include <hooke/gang.hpp>

#include <stdexcept>
#include <string>

namespace hooke {

namespace {
// About a tenth of a millisecond.
constexpr int kSpins = 100'000;
}  // namespace

Gang::Gang(int size) {
  if (size < 1) throw std::invalid_argument("Gang: needs at least one thread, got " + std::to_string(size));
  for (int i = 1; i < size; ++i) threads_.emplace_back([this, i] { serve(i); });
}

Gang::~Gang() {
  stop_ = true;
  call_.fetch_add(1, std::memory_order_release);
  call_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Gang::run(const std::function<void(int)>& work) {
  work_ = &work;
  busy_.store(int(threads_.size()), std::memory_order_relaxed);
  call_.fetch_add(1, std::memory_order_release);
  call_.notify_all();
  work(0);
  for (int i = 0; busy_.load(std::memory_order_acquire) > 0; ++i)
    if (i > kSpins) std::this_thread::yield();
}

void Gang::serve(int index) {
  for (std::uint32_t seen = 0;;) {
    for (int i = 0; i < kSpins && call_.load(std::memory_order_acquire) == seen; ++i) {
    }
    call_.wait(seen, std::memory_order_acquire);
    ++seen;
    if (stop_) return;
    (*work_)(index);
    busy_.fetch_sub(1, std::memory_order_release);
  }
}

}  // namespace hooke
