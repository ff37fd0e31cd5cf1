// PlotJuggler 3: the functions in its document, and those that its releases call instead. Both make parsers
// with the same one, so which function a message is given to says how its pairs are written.
#include <algorithm>
#include <cstdlib>

#include "encoding.hpp"
#include "memory.hpp"
#include "plugin.hpp"

namespace rosidl_proto::plugin {

// Written by rosidl_adapter_proto/plotjuggler/build.py.
extern const char kManifest[];

namespace {

std::string_view text_at(uint32_t address) {
  const std::string_view memory = memory_from(address);
  return memory.substr(0, memory.find('\0'));
}

uint32_t flatten(uint32_t self, uint32_t data, uint32_t size, uint32_t output, FlatFormat format) {
  Parser* const parser = find_parser(self);
  if (parser == nullptr || !is_memory(data, size)) return 0;
  const uint64_t room = std::min(kOutputSize, uint64_t{memory_from(output).size()});
  return static_cast<uint32_t>(parser->flatten(format, {reinterpret_cast<const uint8_t*>(data), size},
                                               {reinterpret_cast<uint8_t*>(output), room}));
}

}  // namespace

ROSIDL_PROTO_EXPORT(pj_plugin_manifest) const char* pj_plugin_manifest() { return kManifest; }

ROSIDL_PROTO_EXPORT(malloc) void* plugin_malloc(size_t size) { return std::malloc(size); }
ROSIDL_PROTO_EXPORT(free) void plugin_free(void* memory) { std::free(memory); }

// Hosts of today leave the topic empty, and put it before the keys themselves.
ROSIDL_PROTO_EXPORT(pj_parser_create)
uint32_t pj_parser_create(uint32_t, uint32_t type_name, uint32_t schema) {
  if (!is_memory(type_name, 1) || !is_memory(schema, 1)) return 0;
  const uint32_t self = add_parser();
  if (self == 0) return 0;
  if (find_parser(self)->load(text_at(type_name), schema_in(memory_from(schema))) == nullptr) return self;
  remove_parser(self);
  return 0;
}

ROSIDL_PROTO_EXPORT(pj_parser_destroy) void pj_parser_destroy(uint32_t self) { remove_parser(self); }

ROSIDL_PROTO_EXPORT(pj_parser_set_array_policy)
void pj_parser_set_array_policy(uint32_t self, uint32_t clamp, uint32_t maximum) {
  const Parser* const parser = find_parser(self);
  if (parser != nullptr && parser->flattener) parser->flattener->set_array_policy({clamp != 0, maximum});
}

ROSIDL_PROTO_EXPORT(pj_parser_parse)
uint32_t pj_parser_parse(uint32_t self, uint32_t data, uint32_t size, uint32_t output) {
  return flatten(self, data, size, output, FlatFormat::Page);
}

ROSIDL_PROTO_EXPORT(pj_parser_decode)
uint32_t pj_parser_decode(uint32_t self, uint32_t data, uint32_t size, uint32_t output) {
  return flatten(self, data, size, output, FlatFormat::Released);
}

}  // namespace rosidl_proto::plugin
