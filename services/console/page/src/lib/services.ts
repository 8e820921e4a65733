// SPDX-License-Identifier: Apache-2.0
// Which statuses are rows of the table of services.
import type { PlainStatus } from './messages.ts';

/**
 * One row a process: by its name, or, where several processes have the same, by what each says of its gyro
 * ("gyro_publisher:3"), since under the name alone each one's word replaces the others'.
 */
export function shownServices(services: PlainStatus[]): PlainStatus[] {
  const processes = new Map<string, Set<string>>();
  const [names, ofGyros] = [services.filter((s) => !s.service.includes(':')), services.filter((s) => /:\d+$/.test(s.service))];
  for (const s of ofGyros) {
    const name = s.service.split(':')[0];
    processes.set(name, (processes.get(name) ?? new Set()).add(`${s.host} ${s.processId}`));
  }
  const isShared = (s: PlainStatus) => (processes.get(s.service.split(':')[0])?.size ?? 0) > 1;
  return [...names.filter((s) => !isShared(s)), ...ofGyros.filter(isShared)].sort((a, b) => a.service.localeCompare(b.service, 'en', { numeric: true }));
}
