#include "plugin.hpp"

#include "encoding.hpp"
#include "memory.hpp"

namespace rosidl_proto::plugin {
namespace {

// Schemas are read with these limits, one after the other, since the last ones need much memory.
constexpr SchemaLimits kLimits[] = {{300, 1'500}, {2'400, 12'000}, {}};

// What a loaded plan takes for each byte of a packed one: an operation of 40 bytes becomes one of 136, a
// field of 24, and places for what is found in a message of 40 bytes or less.
constexpr uint64_t kLoadedSize = 8;

// A handle is the place of a parser, counted from 1, and above it a number that is another one for each
// parser at that place.
constexpr uint32_t kPlaces = 1 << 14, kHandles = 1u << 31;

struct Place {
  uint32_t handle;  // the last one
  Parser* parser;
};

Place places[kPlaces];

Place* find_place(uint64_t handle) {
  Place& place = places[(handle - 1) % kPlaces];
  return place.parser != nullptr && place.handle == handle ? &place : nullptr;
}

}  // namespace

const char* Parser::load(std::string_view type_name, std::string_view schema) noexcept {
  flattener.reset();
  if (schema.size() > kMaximumSchemaSize) return "the schema has more than 4194304 bytes";
  std::vector<uint8_t> packed_plan;
  FlatNotes notes;
  const char* problem = nullptr;
  for (const SchemaLimits& limits : kLimits) {
    if (!have_memory(kSomeMemory + reading_memory(schema.size(), limits))) return kNoMemory;
    problem = read_schema(schema, type_name, &packed_plan, &notes, limits);
    if (problem != kTooManyFields && problem != kTooManyValues) break;
  }
  return problem != nullptr ? problem : load(packed_plan, std::move(notes));
}

const char* Parser::load(const std::vector<uint8_t>& packed_plan, FlatNotes notes) noexcept {
  if (!have_memory(kSomeMemory + kLoadedSize * packed_plan.size())) return kNoMemory;
  Plan plan;
  if (const char* problem = plan.load(packed_plan.data(), packed_plan.size())) return problem;
  auto loaded = std::make_unique<Flattener>();
  const char* const problem = loaded->load(std::move(plan), std::move(notes), FlatFormat::Page);
  if (problem == nullptr) flattener = std::move(loaded);
  return problem;
}

uint64_t Parser::flatten(FlatFormat format, Input message, Output output) noexcept {
  const FixedMemory fixed;
  flattener->set_format(format);
  error = {};
  return flattener->flatten(kSerialization, message, output, error);
}

uint32_t add_parser() noexcept {
  uint32_t free = 0;
  while (free < kPlaces && places[free].parser != nullptr) ++free;
  if (free == kPlaces || !have_memory(sizeof(Parser))) return 0;
  Place& place = places[free];
  place.handle = place.handle == 0 ? free + 1 : (place.handle + kPlaces) % kHandles;
  place.parser = new Parser;
  return place.handle;
}

Parser* find_parser(uint64_t handle) noexcept {
  const Place* const place = find_place(handle);
  return place == nullptr ? nullptr : place->parser;
}

void remove_parser(uint64_t handle) noexcept {
  Place* const place = find_place(handle);
  if (place == nullptr) return;
  delete place->parser;
  place->parser = nullptr;
}

}  // namespace rosidl_proto::plugin
