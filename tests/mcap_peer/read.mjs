// SPDX-License-Identifier: Apache-2.0
// node read.mjs FILE [TOPIC]: reads an MCAP file with @mcap/core, by its index and as a stream, all
// CRCs checked, and decodes every payload by the IDL in the file. Prints one JSON object: counts by
// topic, what both readers saw, and with TOPIC the messages of that topic, a line each, before it.
// Exit code 1 where the two readers differ or anything can't be read.
import { createHash } from "node:crypto";
import { open, readFile } from "node:fs/promises";

import { parseIDL } from "@foxglove/omgidl-parser";
import { MessageReader } from "@foxglove/omgidl-serialization";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { decompress as unzstd } from "fzstd";
import lz4 from "lz4js";

const decompressHandlers = {
  zstd: (data, size) => unzstd(data, new Uint8Array(Number(size))),
  lz4: (data) => lz4.decompress(data),
};

// Order within a topic and the bytes of each message; the two readers order topics differently.
class Digest {
  #topics = new Map();

  add(topic, message) {
    let known = this.#topics.get(topic);
    if (!known) this.#topics.set(topic, (known = { count: 0, hash: createHash("sha256") }));
    ++known.count;
    known.hash.update(`${message.sequence} ${message.logTime} ${message.publishTime} `);
    known.hash.update(message.data);
  }
  finish() {
    return Object.fromEntries(
      [...this.#topics.entries()]
        .sort(([a], [b]) => (a < b ? -1 : 1))
        .map(([topic, { count, hash }]) => [topic, { count, sha256: hash.digest("hex") }]),
    );
  }
}

function readerOf(schema) {
  const definitions = parseIDL(new TextDecoder().decode(schema.data));
  return new MessageReader(schema.name, definitions);
}

async function readIndexed(path, wanted) {
  const handle = await open(path, "r");
  try {
    const { size } = await handle.stat();
    const reader = await McapIndexedReader.Initialize({
      readable: {
        size: async () => BigInt(size),
        read: async (offset, length) => {
          const bytes = new Uint8Array(Number(length));
          await handle.read(bytes, 0, bytes.length, Number(offset));
          return bytes;
        },
      },
      decompressHandlers,
    });
    const decoders = new Map();
    for (const channel of reader.channelsById.values()) {
      const schema = reader.schemasById.get(channel.schemaId);
      if (schema.encoding !== "omgidl" || channel.messageEncoding !== "cdr")
        throw new Error(`${channel.topic}: ${schema.encoding}, ${channel.messageEncoding}`);
      decoders.set(channel.id, readerOf(schema));
    }
    const digest = new Digest();
    for await (const message of reader.readMessages()) {
      const { topic } = reader.channelsById.get(message.channelId);
      digest.add(topic, message);
      const value = decoders.get(message.channelId).readMessage(message.data);
      if (topic === wanted) print(value);
    }
    const attachments = {};
    for await (const attachment of reader.readAttachments())
      attachments[attachment.name] = attachment.data.length;
    const metadata = {};
    for await (const record of reader.readMetadata())
      metadata[record.name] = Object.fromEntries(record.metadata);
    return {
      topics: digest.finish(),
      messages: Number(reader.statistics.messageCount),
      chunks: reader.chunkIndexes.length,
      attachments,
      metadata,
    };
  } finally {
    await handle.close();
  }
}

// Order of the file; a message index isn't needed for it. Sorted by log time, as the indexed reader
// gives messages out, to be compared with it.
async function readStream(path) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(new Uint8Array(await readFile(path)));
  const channels = new Map();
  const messages = [];
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Channel") channels.set(record.id, record.topic);
    if (record.type === "Message")
      messages.push({ ...record, data: new Uint8Array(record.data), topic: channels.get(record.channelId) });
  }
  if (!reader.done()) throw new Error("the stream reader is not done");
  messages.sort((a, b) => (a.logTime < b.logTime ? -1 : a.logTime > b.logTime ? 1 : 0));
  const digest = new Digest();
  for (const message of messages) digest.add(message.topic, message);
  return digest.finish();
}

function print(value) {
  console.log(
    JSON.stringify(value, (_, entry) => {
      if (typeof entry === "bigint") return entry.toString();
      if (ArrayBuffer.isView(entry)) return Array.from(entry);
      return entry;
    }),
  );
}

const [path, wanted] = process.argv.slice(2);
const indexed = await readIndexed(path, wanted);
const streamed = await readStream(path);
if (JSON.stringify(indexed.topics) !== JSON.stringify(streamed)) {
  console.error("the readers differ:", indexed.topics, streamed);
  process.exit(1);
}
print(indexed);
