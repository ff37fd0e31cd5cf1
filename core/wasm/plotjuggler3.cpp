// PlotJuggler 3: the functions of its document and those that its releases call instead. Both make parsers
// with the same function, so that a parser learns how pairs are written from the function that it is asked
// by.
#include <cstdlib>
#include <new>

#include "plugin.hpp"

#define EXPORT(name) __attribute__((export_name(#name), used))

namespace rosidl_proto::plugin {
namespace {

constexpr char kManifest[] = ROSIDL_PROTO_MANIFEST;

// What a parser and what reads its schema need besides what follows from the schema.
constexpr uint64_t kParserMemory = 1 << 20;

}  // namespace

extern "C" {

EXPORT(pj_plugin_manifest) const char* pj_plugin_manifest() { return kManifest; }

EXPORT(malloc) void* exported_malloc(size_t size) { return std::malloc(size); }
EXPORT(free) void exported_free(void* memory) { std::free(memory); }

EXPORT(pj_parser_create)
uint32_t pj_parser_create(uint32_t, uint32_t type_name, uint32_t schema) {
  if (!have_memory(kParserMemory)) return 0;
  auto parser = std::make_unique<Parser>();
  if (parser->load(text_at(type_name), text_at(schema)) != nullptr) return 0;
  return add_parser(std::move(parser));
}

EXPORT(pj_parser_destroy) void pj_parser_destroy(uint32_t parser) { remove_parser(parser); }

EXPORT(pj_parser_set_array_policy)
void pj_parser_set_array_policy(uint32_t, bool, uint32_t) {}

EXPORT(pj_parser_parse)
uint32_t pj_parser_parse(uint32_t, uint32_t, uint32_t, uint32_t) { return 0; }

EXPORT(pj_parser_decode)
uint32_t pj_parser_decode(uint32_t, uint32_t, uint32_t, uint32_t) { return 0; }
}

}  // namespace rosidl_proto::plugin
