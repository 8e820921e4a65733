// SPDX-License-Identifier: Apache-2.0
// Framing of the Foxglove WebSocket protocol, as far as this page speaks it.
// https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md. All integers are little-endian.

export const SUBPROTOCOLS = ['foxglove.websocket.v1', 'foxglove.sdk.v1'];

export interface Channel {
  id: number;
  topic: string;
  encoding: string;
  schemaName: string;
}

export interface ServiceInfo {
  id: number;
  name: string;
  type: string;
}

export type TextFrame =
  | { op: 'serverInfo'; name: string; capabilities: string[]; sessionId?: string }
  | { op: 'status'; level: number; message: string }
  | { op: 'advertise'; channels: Channel[] }
  | { op: 'unadvertise'; channelIds: number[] }
  | { op: 'advertiseServices'; services: ServiceInfo[] }
  | { op: 'unadvertiseServices'; serviceIds: number[] }
  | { op: 'serviceCallFailure'; serviceId: number; callId: number; message: string }
  | { op: 'other' };

export type BinaryFrame =
  | { op: 'message'; subscription: number; logTimeNs: bigint; payload: Uint8Array }
  | { op: 'response'; service: number; call: number; encoding: string; payload: Uint8Array }
  | { op: 'other' };

const MESSAGE_DATA = 0x01;
const SERVICE_CALL_REQUEST = 0x02;
const SERVICE_CALL_RESPONSE = 0x03;
const KNOWN = new Set([
  'serverInfo',
  'status',
  'advertise',
  'unadvertise',
  'advertiseServices',
  'unadvertiseServices',
  'serviceCallFailure',
]);

/** What a text frame says; 'other' for anything that is no JSON object of an operation known here. */
export function parseText(text: string): TextFrame {
  try {
    const frame: unknown = JSON.parse(text);
    if (typeof frame === 'object' && frame !== null && 'op' in frame && KNOWN.has(String(frame.op))) {
      return frame as TextFrame;
    }
  } catch {
    // reported by the answer
  }
  return { op: 'other' };
}

/** What a binary frame says; 'other' for an unknown or cut frame. The payload is a view, not a copy. */
export function parseBinary(buffer: ArrayBuffer): BinaryFrame {
  const view = new DataView(buffer);
  if (view.byteLength >= 13 && view.getUint8(0) === MESSAGE_DATA) {
    return {
      op: 'message',
      subscription: view.getUint32(1, true),
      logTimeNs: view.getBigUint64(5, true),
      payload: new Uint8Array(buffer, 13),
    };
  }
  if (view.byteLength >= 13 && view.getUint8(0) === SERVICE_CALL_RESPONSE) {
    const length = view.getUint32(9, true);
    if (13 + length > view.byteLength) return { op: 'other' };
    return {
      op: 'response',
      service: view.getUint32(1, true),
      call: view.getUint32(5, true),
      encoding: new TextDecoder().decode(new Uint8Array(buffer, 13, length)),
      payload: new Uint8Array(buffer, 13 + length),
    };
  }
  return { op: 'other' };
}

export function subscribe(subscriptions: { id: number; channelId: number }[]): string {
  return JSON.stringify({ op: 'subscribe', subscriptions });
}

export function unsubscribe(subscriptionIds: number[]): string {
  return JSON.stringify({ op: 'unsubscribe', subscriptionIds });
}

export function serviceCall(service: number, call: number, encoding: string, payload: Uint8Array): Uint8Array<ArrayBuffer> {
  const name = new TextEncoder().encode(encoding);
  const frame = new Uint8Array(13 + name.length + payload.length);
  const view = new DataView(frame.buffer);
  view.setUint8(0, SERVICE_CALL_REQUEST);
  view.setUint32(1, service, true);
  view.setUint32(5, call, true);
  view.setUint32(9, name.length, true);
  frame.set(name, 13);
  frame.set(payload, 13 + name.length);
  return frame;
}

/** Gyro id of `/gyro_<id>/<what>`, with <what>; nothing for other topics. */
export function gyroTopic(topic: string): { gyro: number; what: string } | undefined {
  const match = /^\/gyro_(\d+)\/([a-z_]+)$/.exec(topic);
  return match ? { gyro: Number(match[1]), what: match[2] } : undefined;
}

/** Milliseconds before attempt `attempt` (from 0) to connect again: doubles from 250 ms to 8 s. */
export function backoffMs(attempt: number): number {
  return Math.min(8000, 250 * 2 ** Math.min(attempt, 16));
}
