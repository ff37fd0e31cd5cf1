// The plans and the list of forms that Python wrote, read by the core.
#include <cctype>

#include "checks.hpp"

namespace rosidl_proto::test {
namespace {

// BOOLEAN for Boolean
std::string upper(std::string text) {
  for (char& each : text) each = static_cast<char>(std::toupper(static_cast<unsigned char>(each)));
  return text;
}

std::string form_name(CdrForm form) {
  switch (form) {
#define ROSIDL_PROTO_FORM(name, number) \
  case CdrForm::name:                   \
    return upper(#name);
    ROSIDL_PROTO_CDR_FORMS(ROSIDL_PROTO_FORM)
#undef ROSIDL_PROTO_FORM
  }
  return "";
}

std::string shape_name(Shape shape) {
  switch (shape) {
    case Shape::Single:
      return "SINGLE";
    case Shape::Array:
      return "ARRAY";
    case Shape::Sequence:
      return "SEQUENCE";
  }
  return "";
}

std::string bound(uint32_t number) { return number == kUnbounded ? "-" : std::to_string(number); }

std::string operation_text(const Plan& plan, const Operation& op) {
  const std::string protobuf_name = plan.text(op.protobuf_name);
  std::ostringstream text;
  text << "  " << plan.text(op.name) << " = " << (protobuf_name.empty() ? "-" : protobuf_name) << ": type "
       << int{op.scalar} << ", " << form_name(op.cdr) << " to " << static_cast<int>(op.protobuf)
       << ", number " << op.number << ", " << shape_name(op.shape) << " of " << bound(op.count)
       << ", characters " << bound(op.string_bound) << ", message " << op.message
       << (op.omit_empty ? ", omitted if empty\n" : "\n");
  return text.str();
}

std::string plan_text(const Plan& plan) {
  std::ostringstream text;
  text << "plan of version " << kPlanVersion << (plan.partial() ? ", partial\n" : "\n");
  for (uint32_t i = 0; i < plan.message_count(); ++i) {
    const Message& message = plan.message(i);
    text << "message " << i << ": " << plan.text(message.name) << " = " << plan.text(message.protobuf_name)
         << "\n";
    for (const Operation* op = plan.begin(message); op != plan.end(message); ++op) {
      text << operation_text(plan, *op);
    }
  }
  return text.str();
}

TEST(golden_plans_are_read_as_they_were_written) {
  for (const char* name : {"every_form", "image", "chosen_fields", "general"}) {
    CHECK_EQUAL(plan_text(golden_plan(name)), golden(name).text);
  }
}

TEST(forms_are_those_of_python) {
  std::string text;
#define ROSIDL_PROTO_FORM(name, number)                                          \
  text += std::to_string(number) + " " + form_name(CdrForm::name) + " " +        \
          std::to_string(static_cast<int>(Form<CdrForm::name>::kSingle)) + " " + \
          std::to_string(static_cast<int>(Form<CdrForm::name>::kMany)) + " " +   \
          std::to_string(Form<CdrForm::name>::kLargestCharacter) + "\n";
  ROSIDL_PROTO_CDR_FORMS(ROSIDL_PROTO_FORM)
#undef ROSIDL_PROTO_FORM
  CHECK_EQUAL(text, golden_file("forms"));
}

TEST(a_plan_of_another_version_is_refused) {
  Golden packed = golden("image");
  packed.bytes[3] = '1';
  Plan plan;
  CHECK_EQUAL(std::string(plan.load(packed.bytes.data(), packed.bytes.size())),
              "the plan has another version than this core, which reads version 2; build it again");
}

}  // namespace
}  // namespace rosidl_proto::test
