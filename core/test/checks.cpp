#include "checks.hpp"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace rosidl_proto::test {
namespace {

struct Entry {
  const char* name;
  void (*run)();
};

std::vector<Entry>& entries() {
  static std::vector<Entry> all;
  return all;
}

int failures = 0;
std::string folder;

}  // namespace

Test::Test(const char* name, void (*run)()) { entries().push_back({name, run}); }

void report(const char* file, int line, const std::string& what) {
  std::fprintf(stderr, "%s:%d: %s\n", file, line, what.c_str());
  ++failures;
}

std::string golden_file(const std::string& name) {
  std::ifstream file(folder + "/" + name + ".txt", std::ios::binary);
  if (!file) {
    std::fprintf(stderr, "there is no %s.txt in %s\n", name.c_str(), folder.c_str());
    std::exit(2);
  }
  return std::string(std::istreambuf_iterator<char>(file), {});
}

Golden golden(const std::string& name) {
  const std::string content = golden_file(name);
  const std::string mark = "bytes\n";
  const size_t end = content.find("\n" + mark) + 1;
  Golden result{content.substr(0, end), {}};
  std::string digits;
  for (const char each : content.substr(end + mark.size())) {
    if (each == '\n') continue;
    digits += each;
    if (digits.size() < 2) continue;
    result.bytes.push_back(static_cast<uint8_t>(std::strtoul(digits.c_str(), nullptr, 16)));
    digits.clear();
  }
  return result;
}

Plan golden_plan(const std::string& name) {
  const Golden packed = golden(name);
  Plan plan;
  const char* wrong = plan.load(packed.bytes.data(), packed.bytes.size());
  if (wrong != nullptr) report(__FILE__, __LINE__, name + ": " + wrong);
  return plan;
}

}  // namespace rosidl_proto::test

int main(int argc, char** argv) {
  using namespace rosidl_proto::test;
  if (argc != 2) return std::fprintf(stderr, "usage: %s GOLDEN_PLANS\n", argv[0]), 2;
  folder = argv[1];
  for (const auto& each : entries()) {
    const int before = failures;
    each.run();
    std::printf("%s %s\n", failures == before ? "good " : "WRONG", each.name);
  }
  return failures == 0 ? 0 : 1;
}
