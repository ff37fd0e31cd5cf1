// The same emulation for Node, as a second engine: reads one job from standard input, writes the outputs.
import { readFileSync } from "node:fs";

const job = JSON.parse(readFileSync(0, "utf8"));
const module = new WebAssembly.Module(readFileSync(job.plugin));
const { exports } = new WebAssembly.Instance(module, {});
exports._initialize();

const bytes = () => new Uint8Array(exports.memory.buffer);
const allocate = (size, content) => {
  const address = exports.malloc(size) >>> 0;
  if (address === 0) throw new Error("WASM malloc returned null");
  if (content) bytes().set(content, address);
  return address;
};
const text = (content) => allocate(content.length + 1, Buffer.concat([content, Buffer.from([0])]));

const answers = job.topics.map((topic) => {
  const schema = Buffer.from(topic.schema, "base64");
  const parser = exports.pj_parser_create(text(Buffer.from("")), text(Buffer.from(topic.type_name)), text(schema));
  if (topic.array_policy) exports.pj_parser_set_array_policy(parser, ...topic.array_policy);
  let size = 128 * 1024;
  let input = allocate(size);
  const output = allocate(1024 * 1024);
  const outputs = topic.messages.map((encoded) => {
    const message = Buffer.from(encoded, "base64");
    if (size < message.length) {
      exports.free(input);
      size = Math.max(2 * size, message.length);
      input = allocate(size);
    }
    bytes().set(message, input);
    const written = exports[job.function](parser, input, message.length, output);
    return written <= 0 ? null : Buffer.from(bytes().slice(output, output + written)).toString("base64");
  });
  exports.pj_parser_destroy(parser);
  return outputs;
});
process.stdout.write(JSON.stringify(answers));
