// Runs the fuzz target without libFuzzer: each input of a corpus as it is, cut at every place, and mutated
// with a fixed seed. For compilers without -fsanitize=fuzzer, and for a bounded run that is the same each
// time.
//
//   driver MUTATIONS FILE...
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace {

using Bytes = std::vector<uint8_t>;

uint64_t random_state = 0x9e3779b97f4a7c15;

// xorshift64 (Marsaglia 2003)
uint64_t random_below(uint64_t bound) {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 7;
  random_state ^= random_state << 17;
  return random_state % bound;
}

void run(const Bytes& input) {
  // A copy of exact size, so that a read beyond it is seen.
  uint8_t* const copy = static_cast<uint8_t*>(std::malloc(input.size() + (input.empty() ? 1 : 0)));
  for (size_t i = 0; i < input.size(); ++i) copy[i] = input[i];
  LLVMFuzzerTestOneInput(copy, input.size());
  std::free(copy);
}

Bytes mutate(Bytes input, const Bytes& other) {
  constexpr uint8_t kInteresting[] = {0x00, 0x01, 0x02, 0x7f, 0x80, 0xff, 0xc0, 0xd8};
  for (uint64_t n = 1 + random_below(6); n > 0 && !input.empty(); --n) {
    const size_t at = random_below(input.size());
    switch (random_below(7)) {
      case 0:
        input[at] ^= static_cast<uint8_t>(1u << random_below(8));
        break;
      case 1:
        input[at] = static_cast<uint8_t>(random_below(256));
        break;
      case 2:
        input[at] = kInteresting[random_below(sizeof kInteresting)];
        break;
      case 3:
        input.erase(input.begin() + static_cast<std::ptrdiff_t>(at),
                    input.begin() + static_cast<std::ptrdiff_t>(at + random_below(input.size() - at) / 4));
        break;
      case 4:
        input.insert(input.begin() + static_cast<std::ptrdiff_t>(at), 1 + random_below(8),
                     static_cast<uint8_t>(random_below(256)));
        break;
      case 5: {  // Repeat a piece: fields that come twice
        const size_t size = random_below(input.size() - at) / 2;
        const Bytes piece(input.begin() + static_cast<std::ptrdiff_t>(at),
                          input.begin() + static_cast<std::ptrdiff_t>(at + size));
        const size_t to = random_below(input.size());
        input.insert(input.begin() + static_cast<std::ptrdiff_t>(to), piece.begin(), piece.end());
        break;
      }
      default:  // Go on as another input
        if (at < other.size())
          input.resize(at),
              input.insert(input.end(), other.begin() + static_cast<std::ptrdiff_t>(at), other.end());
    }
  }
  return input;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: %s MUTATIONS FILE...\n", argv[0]), 2;
  std::vector<Bytes> corpus;
  for (int i = 2; i < argc; ++i) {
    std::FILE* const file = std::fopen(argv[i], "rb");
    if (file == nullptr) return std::perror(argv[i]), 2;
    Bytes bytes(1 << 20);
    bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file));
    std::fclose(file);
    corpus.push_back(bytes);
  }
  for (const Bytes& each : corpus) {
    for (size_t size = 0; size <= each.size(); ++size)
      run(Bytes(each.begin(), each.begin() + static_cast<std::ptrdiff_t>(size)));
  }
  const long mutations = std::atol(argv[1]);
  for (long i = 0; i < mutations; ++i) {
    run(mutate(corpus[random_below(corpus.size())], corpus[random_below(corpus.size())]));
  }
  std::printf("%zu inputs, %ld mutations\n", corpus.size(), mutations);
  return 0;
}
