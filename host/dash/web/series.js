// What charts draw, for a link the last minute, for a recording all of it.

/** Columns of a point after its time: fx, fy, fz, drive, torque, measured fx, fy, fz, drive, half widths of the same four. */
const COLUMNS = 13;
const MOST = 3600;

export class Series {
  constructor() {
    this.t = [];
    this.columns = Array.from({ length: COLUMNS }, () => []);
    this.newest = 0;
  }

  /** Takes numbered points; those that are there already are left out. */
  push(points) {
    for (const [number, [t, ...values]] of points) {
      if (number <= this.newest) continue;
      this.newest = number;
      this.t.push(t);
      values.forEach((value, k) => this.columns[k].push(value));
    }
    if (this.t.length > MOST + 600) {
      this.t = this.t.slice(-MOST);
      this.columns = this.columns.map((column) => column.slice(-MOST));
    }
  }

  /** As it is now, while the original goes on. */
  copy() {
    const same = new Series();
    same.t = this.t.slice();
    same.columns = this.columns.map((column) => column.slice());
    return same;
  }

  column(k, i) {
    const value = this.columns[k]?.[i];
    return value === undefined || value === null || Number.isNaN(value) ? null : value;
  }

  vector(first, i, tare) {
    const xyz = [0, 1, 2].map((k) => this.column(first + k, i));
    return xyz.some((x) => x === null) ? null : Math.hypot(...xyz.map((x, k) => x - (tare?.[k] ?? 0)));
  }

  /** Force 0 to 3, torque 4, or the size of the force, less the tare. */
  value(of, i, tare, scale = 1) {
    if (of === "size") return this.vector(0, i, tare);
    const value = this.column(of, i);
    return value === null ? null : scale * (value - (tare?.[of] ?? 0));
  }

  measuredValue(of, i, tare) {
    if (of === "size") return this.vector(5, i, tare);
    if (of === 4) return null;
    const value = this.column(5 + of, i);
    return value === null ? null : value - (tare?.[of] ?? 0);
  }

  halfWidth(of, i) { return of === "size" || of === 4 ? null : this.column(9 + of, i); }

  /** Of the points from one index to another, the one with the largest force. In a long recording it looks at
   * every point. It makes no objects on the way, because collecting them would be seen as a pause. */
  largest(from, to) {
    const [x, y, z] = this.columns;
    let best = from, most = -1;
    for (let i = from; i < to; i++) {
      const square = x[i] * x[i] + y[i] * y[i] + z[i] * z[i];
      if (square > most) { most = square; best = i; }
    }
    return best;
  }

  /** Forces and torque at an index, as a tare. */
  tareAt(i) { return [0, 1, 2, 3, 4].map((k) => this.column(k, i) ?? 0); }
}
