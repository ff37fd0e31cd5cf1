// A sort of little code, a tenth of that of std::sort: plans are made and read in WebAssembly as well.
#pragma once

#include <algorithm>
#include <functional>

namespace rosidl_proto {

template <class Iterator, class IsLess = std::less<>>
void heap_sort(Iterator first, Iterator last, IsLess is_less = {}) {
  std::make_heap(first, last, is_less);
  std::sort_heap(first, last, is_less);
}

}  // namespace rosidl_proto
