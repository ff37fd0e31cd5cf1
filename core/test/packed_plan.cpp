// Plans that the core makes have the bytes that Python gives them.
#include "schema/packed_plan.hpp"

#include "checks.hpp"

namespace rosidl_proto::test {
namespace {

// What a plan was made from: its names point into `names`, and messages come parts first.
std::vector<PlannedMessage> planned(const Plan& plan, std::vector<std::string>* names) {
  const uint32_t count = plan.message_count();
  std::vector<PlannedMessage> messages(count);
  for (uint32_t i = 0; i < count; ++i) {
    const Message& message = plan.message(i);
    PlannedMessage& result = messages[count - 1 - i];
    result.name = plan.text(message.name);
    result.protobuf_name = plan.text(message.protobuf_name);
    for (const Operation* op = plan.begin(message); op != plan.end(message); ++op) {
      names->push_back(plan.text(op->name));
      const ProtobufForm protobuf =
          op->protobuf == ProtobufForm::None ? ProtobufForm::None : protobuf_form(op->cdr, op->shape);
      const uint32_t nested = op->cdr == CdrForm::Message ? count - 1 - op->message : 0;
      result.fields.push_back({names->back(), op->scalar, op->cdr, protobuf, op->shape, op->number, op->count,
                               op->string_bound, nested});
    }
  }
  return messages;
}

TEST(a_plan_is_packed_as_python_packs_it) {
  std::vector<std::string> names;
  names.reserve(1000);  // they stay where they are
  const std::vector<PlannedMessage> messages = planned(golden_plan("every_form"), &names);
  CHECK_EQUAL(pack_plan(messages) == golden("every_form").bytes, true);
}

}  // namespace
}  // namespace rosidl_proto::test
