// Rows of numbers as a PX4 ULog file.
//
// Source: docs.px4.io, "ULog File Format".

"use strict";

function message(kind, content) {
  const head = Buffer.alloc(3);
  head.writeUInt16LE(content.length);
  head.write(kind, 2);
  return Buffer.concat([head, content]);
}

/** Samples of accelerometers (m/s²) and gyros (rad/s) at this rate, Hz. */
module.exports = (rows, rate) => {
  const fields = "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;";
  const sample = ([ax, ay, az, gx, gy, gz], k) => {
    const data = Buffer.alloc(34);
    data.writeBigUInt64LE(BigInt(Math.round(((k + 1) / rate) * 1e6)), 2);
    [gx, gy, gz, ax, ay, az].forEach((value, place) => data.writeFloatLE(value, 10 + 4 * place));
    return message("D", data);
  };
  return Buffer.concat([
    Buffer.from("ULog\x01\x12\x35\x01", "latin1"),
    Buffer.alloc(8),
    message("B", Buffer.alloc(40)),
    message("F", Buffer.from(`sensor_combined:${fields}`)),
    message("A", Buffer.concat([Buffer.alloc(3), Buffer.from("sensor_combined")])),
    ...rows.map(sample),
  ]);
};
