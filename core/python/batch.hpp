// Many messages at once, on several threads, into one piece of memory. This part knows nothing of Python.
//
// Threads take blocks of messages. A block is measured, gets its place after the block before it, and is
// written while it is still in the cache. So where a result lies does not depend on the threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>
#include <vector>

#include "direction.hpp"

namespace rosidl_proto {

// Where in a buffer a message lies, from its first byte to the one after its last.
struct Range {
  uint64_t first, last;

  bool missing() const { return first == UINT64_MAX; }
};

// The place of a message that could not be transcoded: no buffer is so large.
constexpr Range kNowhere = {UINT64_MAX, UINT64_MAX};

// A block is complete with so many bytes of input, or with so many messages.
constexpr uint64_t kBlockSize = 32 * 1024;
constexpr size_t kBlockMessages = 256;

// Calls `work(i)` for each i below `count`, in order of i, on up to `threads` threads, but on no more than
// the machine runs at once: blocks wait for their turn. `work` does not throw.
template <class Work>
void run_on_threads(size_t threads, size_t count, Work work) {
  std::atomic<size_t> next{0};
  const auto loop = [&] {
    for (size_t i = next++; i < count; i = next++) work(i);
  };
  const size_t at_once = std::max<size_t>(std::thread::hardware_concurrency(), 1);
  std::vector<std::thread> others;
  try {
    for (size_t i = 1; i < std::min({threads, count, at_once}); ++i) others.emplace_back(loop);
  } catch (const std::exception&) {
    // The system has no more threads: those that there are do all of it.
  }
  loop();
  for (std::thread& each : others) each.join();
}

template <class Direction>
class Batch {
 public:
  Batch(const Plan& plan, uint64_t size_limit) : plan_(plan), size_limit_(size_limit) {}

  void reserve(size_t count) { messages_.reserve(count); }
  size_t size() const { return messages_.size(); }
  Input operator[](size_t index) const { return messages_[index]; }

  void add(Input message) {
    if (blocks_.empty() || block_size_ >= kBlockSize || size() - blocks_.back() >= kBlockMessages) {
      blocks_.push_back(size());
      block_size_ = 0;
    }
    messages_.push_back(message);
    block_size_ += message.size;
  }

  // Transcodes all messages, and sets the range in `output` of each result. Returns how many bytes the
  // results take. If these are more than there are, the output is not complete.
  uint64_t run(size_t threads, Output output, Range* ranges) const {
    std::atomic<size_t> turn{0};  // the block that gets its place next
    uint64_t end = 0;             // of the blocks before it
    run_on_threads(threads, blocks_.size(), [&](size_t block) {
      const size_t first = blocks_[block], last = block + 1 < blocks_.size() ? blocks_[block + 1] : size();
      Scratch scratch(plan_);
      uint64_t marks[kBlockMessages];
      const uint64_t size = measure(first, last, scratch, marks, ranges);
      while (turn.load(std::memory_order_acquire) != block) std::this_thread::yield();
      const uint64_t begin = end;
      end += size;
      turn.store(block + 1, std::memory_order_release);
      if (begin + size <= output.size) write(first, last, scratch, marks, output, begin, ranges);
    });
    return end;
  }

  // What is wrong with a message that failed: found by doing it again, so that nothing need be kept for the
  // others.
  Error error(size_t index) const {
    const Input input = messages_[index];
    Error error;
    Scratch scratch(plan_);
    uint64_t size = 0;
    if (!Direction::measure(plan_, input, size_limit_, scratch, &size, error)) return error;
    std::vector<uint8_t> memory(static_cast<size_t>(size));
    if (Direction::write(plan_, input, scratch, 0, {memory.data(), size}, error))
      error.reason = Reason::Changed;
    return error;
  }

 private:
  using Scratch = typename Direction::Scratch;

  // Sets the sizes in `ranges`, and returns their sum.
  uint64_t measure(size_t first, size_t last, Scratch& scratch, uint64_t* marks, Range* ranges) const {
    Error error;
    uint64_t total = 0;
    for (size_t i = first; i < last; ++i) {
      marks[i - first] = scratch.mark();
      uint64_t size = 0;
      if (Direction::measure(plan_, messages_[i], size_limit_, scratch, &size, error)) {
        ranges[i] = {0, size};
        total += size;
      } else {
        ranges[i] = kNowhere;
      }
    }
    return total;
  }

  // Moves the ranges to their places, and writes there. A message that turns out to be wrong only now leaves
  // zeros.
  void write(size_t first, size_t last, Scratch& scratch, const uint64_t* marks, Output output,
             uint64_t begin, Range* ranges) const {
    Error error;
    for (size_t i = first; i < last; ++i) {
      if (ranges[i].missing()) continue;
      const uint64_t size = ranges[i].last;
      const Output place = {output.data + begin, size};
      ranges[i] = {begin, begin + size};
      begin += size;
      if (Direction::write(plan_, messages_[i], scratch, marks[i - first], place, error)) continue;
      std::fill_n(place.data, place.size, uint8_t{0});
      ranges[i] = kNowhere;
    }
  }

  const Plan& plan_;
  const uint64_t size_limit_;
  std::vector<Input> messages_;
  std::vector<size_t> blocks_;  // the first message of each
  uint64_t block_size_ = 0;     // of the last one
};

}  // namespace rosidl_proto
