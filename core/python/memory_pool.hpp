// Memory of results, which is used again: to get pages from the system takes longer than to transcode into
// them. This part knows nothing of Python.
#pragma once

#include <memory>
#include <mutex>
#include <rosidl_adapter_proto/memory.hpp>
#include <utility>
#include <vector>

namespace rosidl_proto {

class MemoryPool {
 public:
  MemoryPool() { kept_.reserve(kMost); }

  // Empty memory, if there is any that was used before; otherwise it has no room yet.
  Memory take() {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kept_.empty()) return {};
    Memory memory = std::move(kept_.back());
    kept_.pop_back();
    return memory;
  }

  void give(Memory memory) noexcept {
    memory.cut(0);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (kept_.size() < kMost) kept_.push_back(std::move(memory));
  }

 private:
  static constexpr size_t kMost = 16;  // results of one converter that are in use at once, hardly ever more

  std::mutex mutex_;
  std::vector<Memory> kept_;
};

// Memory that goes back to its pool, which lives as long as any of it.
class PooledMemory : public Memory {
 public:
  PooledMemory(Memory memory, std::shared_ptr<MemoryPool> pool)
      : Memory(std::move(memory)), pool_(std::move(pool)) {}
  PooledMemory(PooledMemory&&) = default;
  PooledMemory& operator=(PooledMemory&&) = delete;
  ~PooledMemory() {
    if (pool_) pool_->give(std::move(*this));
  }

 private:
  std::shared_ptr<MemoryPool> pool_;
};

}  // namespace rosidl_proto
