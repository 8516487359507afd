// usage: node check.mjs FILE.mcap FILE.csv
// Opens an exported MCAP file with MCAP's own readers, indexed and streaming (checksums verified), and compares
// every message with the CSV export of the same recording: names with units, times, values to the last bit.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress } from "fzstd";

const [mcapPath, csvPath] = process.argv.slice(2);
const bytes = new Uint8Array(readFileSync(mcapPath));
const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };

const [header, ...lines] = readFileSync(csvPath, "utf8").trimEnd().split("\n").map((line) => line.split(","));
const columnOf = new Map(header.map((name, index) => [name, index]));

const file = {
  size: async () => BigInt(bytes.length),
  read: async (offset, length) => bytes.subarray(Number(offset), Number(offset + length)),
};
const reader = await McapIndexedReader.Initialize({ readable: file, decompressHandlers });
const schemas = new Map([...reader.schemasById].map(([id, s]) => [id, JSON.parse(new TextDecoder().decode(s.data))]));

let messages = 0, values = 0, events = 0, startTime;
const fieldsSeen = new Set();
for await (const message of reader.readMessages()) {
  ++messages;
  const channel = reader.channelsById.get(message.channelId);
  assert.equal(channel.messageEncoding, "json");
  const schema = schemas.get(channel.schemaId);
  const content = JSON.parse(new TextDecoder().decode(message.data));
  for (const field of Object.keys(content)) assert.ok(schema.properties[field], `${channel.topic} ${field} is in the schema`);
  if (channel.topic === "/events") {
    ++events;
    continue;
  }
  const row = lines[message.sequence];
  startTime ??= message.logTime - BigInt(Math.round(Number(row[0]) * 1e9));
  assert.equal(message.logTime - startTime, BigInt(Math.round(Number(row[0]) * 1e9)));
  const device = channel.topic.slice(1).replaceAll("/", ".");
  for (const [field, value] of Object.entries(content)) {
    const name = `${device}.${field}`;
    assert.ok(columnOf.has(name), `${name} is a column of the CSV`);
    assert.ok(Object.is(value, Number(row[columnOf.get(name)])), `${name} in row ${message.sequence}`);
    if (/_(pa|rad_s|nm|j|w|n|m_s|m_s2|rad|degc)$/.test(field)) assert.ok(schema.properties[field].unit, `${name} has a unit`);
    fieldsSeen.add(name);
    ++values;
  }
}
assert.equal(BigInt(messages), reader.statistics.messageCount);
assert.equal(fieldsSeen.size, header.length - 1, "every signal is there");
const finite = lines.reduce((sum, row) => sum + row.slice(1).filter((v) => Number.isFinite(Number(v)) && v !== "nan").length, 0);
assert.equal(values, finite, "every finite value is there");

const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(bytes);
let streamed = 0, footer = false;
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Message") ++streamed;
  if (record.type === "Footer") footer = true;
}
assert.ok(footer && stream.done());
assert.equal(streamed, messages);
const metadata = [];
for await (const entry of reader.readMetadata()) metadata.push(entry.name);
assert.deepEqual(metadata, ["model", "scenario", "run"]);
console.log(`${messages} messages on ${reader.channelsById.size} topics in ${reader.chunkIndexes.length} chunks, ` +
            `${values} values equal to the CSV, ${events} events`);
