// Valid messages to read, made along a plan.
#include <algorithm>
#include <random>

#include "checks.hpp"
#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto::test {
namespace {

class Writer {
 public:
  Writer(const Plan& plan, uint32_t seed) : plan_(plan), random_(seed), out_{0, 1, 0, 0} {}

  Bytes run() {
    message(plan_.root());
    return out_;
  }

 private:
  void message(const Message& message) {
    for (const Operation* op = plan_.begin(message); op != plan_.end(message); ++op) field(*op);
  }

  void field(const Operation& op) {
    uint32_t count = 1;
    if (op.shape == Shape::Array) count = op.count;
    if (op.shape == Shape::Sequence) number<uint32_t>(count = std::min(op.count, below(4)));
    for (uint32_t i = 0; i < count; ++i) {
      visit(op.cdr, [&](auto form) { element<decltype(form)>(op); });
    }
  }

  template <class F>
  void element(const Operation& op) {
    if constexpr (F::kIsNumber) {
      using Raw = typename F::Raw;
      // Characters have to be text, numbers are zero now and then, and what protobuf does not have always is.
      const uint64_t any = F::kIsText ? 'a' + below(26) : uint64_t{random_()} << 32 | random_();
      const bool zero = below(4) == 0 || op.protobuf == ProtobufForm::None;
      const auto raw = static_cast<Raw>(zero && !F::kIsText ? 0 : any);
      number<Raw>(F::is_value(raw) ? raw : Raw{1});
    } else if constexpr (F::kIsString) {
      const uint32_t units = std::min(op.string_bound, below(6));
      number<uint32_t>(static_cast<uint32_t>(units + F::kTerminator));
      for (uint32_t i = 0; i < units; ++i) {
        const uint32_t unit = 'a' + below(26);
        F::kUnitSize == 1 ? number<uint8_t>(static_cast<uint8_t>(unit)) : number<uint32_t>(unit);
      }
      for (uint64_t i = 0; i < F::kTerminator; ++i) number<uint8_t>(0);
    } else {
      message(plan_.message(op.message));
    }
  }

  template <class T>
  void number(T value) {
    while ((out_.size() - 4) % sizeof(T) != 0) out_.push_back(0);
    out_.resize(out_.size() + sizeof(T));
    store_little(out_.data() + out_.size() - sizeof(T), value);
  }

  uint32_t below(uint32_t bound) { return static_cast<uint32_t>(random_() % bound); }

  const Plan& plan_;
  std::mt19937 random_;
  Bytes out_;
};

}  // namespace

Bytes random_cdr(const Plan& plan, uint32_t seed) { return Writer(plan, seed).run(); }

}  // namespace rosidl_proto::test
