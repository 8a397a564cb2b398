// Someone else's MAVLink (npm node-mavlink with mavlink-mappings), as a program for tests/conformance/mavlink_test.cpp.
//
//   node peer.js write SEED   writes two messages of each kind that the product knows, with values drawn from the seed, one a line:
//                               words | frame of version 2 | of version 2, signed | of version 1 (kinds without extensions)
//   node peer.js read         reads frames from stdin, as hex in any cut, and writes each one's words on a line
//
// Words: NAME field=value ..., in the order of the wire; floats as their bits, arrays with commas, text up to its end.
// The golden file of the unit tests is made with:  node peer.js write 1 > tests/data/mavlink/frames.txt
'use strict';
const { MavLinkPacketSplitter, MavLinkPacketParser, MavLinkProtocolV1, MavLinkProtocolV2, MavLinkPacketSignature } = require('node-mavlink');
const { minimal, common } = require('mavlink-mappings');
const { Readable } = require('stream');

const registry = { ...minimal.REGISTRY, ...common.REGISTRY };
const kinds = [0, 1, 2, 11, 20, 22, 23, 30, 31, 32, 65, 76, 77, 82, 93, 105, 107, 111, 113, 115, 147, 245, 253, 331];

function wordsOf(message) {
  const bits = Buffer.alloc(4);
  const word = (value, type) => {
    if (type.startsWith('float')) {
      bits.writeFloatBE(value);
      return bits.toString('hex');
    }
    return String(value);
  };
  const fields = message.constructor.FIELDS.map((field) => {
    const value = message[field.name];
    if (field.type === 'char[]') return `${field.source}=${value}`;
    if (field.type.endsWith('[]')) return `${field.source}=${value.map((v) => word(v, field.type)).join(',')}`;
    return `${field.source}=${word(value, field.type)}`;
  });
  return [message.constructor.MSG_NAME, ...fields].join(' ');
}

function write(seed) {
  let state = BigInt(seed);
  const bits = (count) => {  // Knuth's MMIX generator, its upper bits
    state = (state * 6364136223846793005n + 1442695040888963407n) & 0xffffffffffffffffn;
    return state >> BigInt(64 - count);
  };
  const drawn = (type) => {
    const wide = type.match(/int(\d+)_t/);
    if (wide) {
      const size = Number(wide[1]);
      const raw = bits(size);
      const value = type.startsWith('u') ? raw : BigInt.asIntN(size, raw);
      return size === 64 ? value : Number(value);
    }
    return Number(BigInt.asIntN(24, bits(24))) / 4096;  // exact as a float
  };
  const letters = (length) => Array.from({ length }, () => String.fromCharCode(97 + Number(bits(4)))).join('');
  const key = MavLinkPacketSignature.key('nobody checks it');
  const v2 = new MavLinkProtocolV2(3, 1);
  const v1 = new MavLinkProtocolV1(3, 1);
  let sequence = 0;
  for (const id of kinds) {
    for (const sparse of [false, true]) {  // sparse: no extensions, short texts, so that zeros are cut off
      const message = new registry[id]();
      const definition = message.constructor;
      for (const field of definition.FIELDS) {
        const array = field.type.endsWith('[]');
        const type = array ? field.type.slice(0, -2) : field.type;
        const empty = sparse && field.extension;
        if (type === 'char') message[field.name] = letters(sparse ? 5 : field.length);
        else if (array) message[field.name] = Array.from({ length: field.length }, () => (empty ? 0 : drawn(type)));
        else if (empty) message[field.name] = type.includes('64') ? 0n : 0;
        else message[field.name] = drawn(type === 'uint8_t_mavlink_version' ? 'uint8_t' : type);
      }
      const plain = v2.serialize(message, sequence);
      const signing = new MavLinkProtocolV2(3, 1, MavLinkProtocolV2.IFLAG_SIGNED);
      const signed = signing.sign(signing.serialize(message, sequence), 0, key, Date.UTC(2026, 0, 1));
      const extended = definition.FIELDS.some((field) => field.extension);
      const old = extended ? '' : v1.serialize(message, sequence).toString('hex');
      console.log([wordsOf(message), plain.toString('hex'), signed.toString('hex'), old].join(' | '));
      sequence = (sequence + 1) % 256;
    }
  }
}

function read() {
  const parser = Readable.from(hexChunks()).pipe(new MavLinkPacketSplitter()).pipe(new MavLinkPacketParser());
  parser.on('data', (packet) => {
    const definition = registry[packet.header.msgid];
    console.log(definition ? wordsOf(packet.protocol.data(packet.payload, definition)) : `unknown ${packet.header.msgid}`);
  });
}
async function* hexChunks() {
  let rest = '';
  for await (const chunk of process.stdin) {
    rest += chunk.toString('latin1').replace(/\s/g, '');
    const whole = rest.length - (rest.length % 2);
    yield Buffer.from(rest.slice(0, whole), 'hex');
    rest = rest.slice(whole);
  }
}

if (process.argv[2] === 'write') write(process.argv[3] || '1');
else if (process.argv[2] === 'read') read();
else process.exit(2);
