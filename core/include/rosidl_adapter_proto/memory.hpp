// Memory that grows. It is not filled with zeros, since all that counts is written.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <utility>

namespace rosidl_proto {

class Memory {
 public:
  Memory() = default;
  Memory(Memory&& other) noexcept { *this = std::move(other); }
  Memory& operator=(Memory&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(size_, other.size_);
    std::swap(capacity_, other.capacity_);
    return *this;
  }
  ~Memory() { std::free(data_); }

  uint8_t* data() { return data_; }
  const uint8_t* data() const { return data_; }
  uint64_t size() const { return size_; }
  uint64_t capacity() const { return capacity_; }

  // Makes room for `more` bytes behind what there is, and returns their place; nullptr if there is no memory.
  uint8_t* reserve(uint64_t more) {
    if (more > capacity_ - size_ && !grow(larger(size_ + more, capacity_ + capacity_ / 2))) return nullptr;
    return data_ + size_;
  }
  // So many of the bytes that there is room for are written.
  void add(uint64_t written) { size_ += written; }
  // Forgets what is behind so many bytes.
  void cut(uint64_t size) { size_ = size; }

  // Makes room for `capacity` bytes in all, which are not fewer than there are; false if there is no memory.
  bool grow(uint64_t capacity) {
    if (capacity > SIZE_MAX) return false;
    if (size_ == 0) {  // there is nothing to move
      std::free(std::exchange(data_, nullptr));
      capacity_ = 0;
    }
    void* const memory = std::realloc(data_, static_cast<size_t>(capacity));
    if (memory == nullptr) return false;
    data_ = static_cast<uint8_t*>(memory);
    capacity_ = capacity;
    return true;
  }

 private:
  static uint64_t larger(uint64_t a, uint64_t b) { return a > b ? a : b; }

  uint8_t* data_ = nullptr;
  uint64_t size_ = 0, capacity_ = 0;
};

}  // namespace rosidl_proto
