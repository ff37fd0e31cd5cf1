// What tests are written with: `TEST` makes a test of a function, `CHECK` and `CHECK_EQUAL` say where
// something is wrong, and go on.
#pragma once

#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

#include "rosidl_adapter_proto/plan.hpp"

namespace rosidl_proto::test {

struct Test {
  Test(const char* name, void (*run)());
};

void report(const char* file, int line, const std::string& what);

template <class Found, class Expected>
void check_equal(const char* file, int line, const char* text, const Found& found, const Expected& expected) {
  if (found == expected) return;
  std::ostringstream message;
  message << text << "\n  is       " << found << "\n  expected " << expected;
  report(file, line, message.str());
}

#define TEST(name)                                                   \
  static void name();                                                \
  static const ::rosidl_proto::test::Test name##_test(#name, &name); \
  static void name()

#define CHECK(condition) \
  ((condition) ? void() : ::rosidl_proto::test::report(__FILE__, __LINE__, #condition " is false"))

#define CHECK_EQUAL(found, expected) \
  ::rosidl_proto::test::check_equal(__FILE__, __LINE__, #found, found, expected)

using Bytes = std::vector<uint8_t>;

// A file of tests/golden/plans: a plan as text and as bytes.
struct Golden {
  std::string text;
  Bytes bytes;
};
std::string golden_file(const std::string& name);
Golden golden(const std::string& name);

// The plan of a golden file.
Plan golden_plan(const std::string& name);

// A valid message of a plan, another one for each seed.
Bytes random_cdr(const Plan& plan, uint32_t seed);

// Both directions, as users call them; if something is wrong, `*error` says what and where, and nothing is
// returned.
Bytes to_proto(const Plan& plan, const Bytes& cdr, std::string* error);
Bytes to_cdr(const Plan& plan, const Bytes& proto, std::string* error);

}  // namespace rosidl_proto::test
