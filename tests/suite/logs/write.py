"""Writes rows of accelerometers (m/s^2) and gyros (rad/s) as every format by its own Python package.

write.py IMU.log PERIOD_S DIRECTORY [FORMAT ...]: writes DIRECTORY/imu.FORMAT, says `skipped FORMAT: why` where a
package is missing.
"""

import json
import os
import struct
import sys

import numpy as np

START_NS = 1_700_000_000_000_000_000


def stamps(rows, period):
    return [START_NS + round(k * period * 1e9) for k in range(1, rows + 1)]


def npz(path, time, accel, gyro):
    np.savez(path, t=time, gyro=gyro, acc=accel)


def npz_deflated(path, time, accel, gyro):
    np.savez_compressed(path, t=time, gyro=gyro, acc=accel)


def npy(path, time, accel, gyro):
    kind = [("t", "<f8"), ("gyro", "<f8", (3,)), ("acc", "<f8", (3,))]
    rows = np.zeros(len(time), dtype=kind)
    rows["t"], rows["gyro"], rows["acc"] = time, gyro, accel
    np.save(path, rows)


def mat(path, time, accel, gyro):
    from scipy.io import savemat

    savemat(path, {"imu": {"t": time, "gyro": gyro, "acc": accel}}, do_compression=True)


def mat_plain(path, time, accel, gyro):
    from scipy.io import savemat

    savemat(path, {"t": time, "gyro": gyro.T, "acc": accel.T})


def mat_of_hdf5(path, time, accel, gyro):
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        imu = file.create_group("imu")
        for name, columns in (("t", time), ("gyro", gyro), ("acc", accel)):
            # MATLAB's first dimension is HDF5's last.
            imu.create_dataset(name, data=np.atleast_2d(columns.T), compression="gzip")
            imu[name].attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(116) + bytes(8) + b"\x00\x02IM")


def hdf5(path, time, accel, gyro):
    import h5py

    with h5py.File(path, "w") as file:
        chunks = {"compression": "gzip", "shuffle": True, "fletcher32": True}
        file.create_dataset("imu/t", data=time)
        file.create_dataset("imu/gyro", data=gyro, chunks=(1000, 3), **chunks)
        file.create_dataset("imu/acc", data=accel.T, chunks=(2, 1000), **chunks)


IMU_DEFINITION = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: geometry_msgs/Quaternion
float64 x 0
float64 y 0
float64 z 0
float64 w 1
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""


def imu_message(ns, accel, gyro):
    vector = lambda v: {"x": float(v[0]), "y": float(v[1]), "z": float(v[2])}
    return {
        "header": {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}, "frame_id": "imu"},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        "orientation_covariance": [-1.0] + [0.0] * 8,
        "angular_velocity": vector(gyro),
        "angular_velocity_covariance": [0.0] * 9,
        "linear_acceleration": vector(accel),
        "linear_acceleration_covariance": [0.0] * 9,
    }


def mcap_ros2(path, time, accel, gyro, compression="zstd"):
    from mcap.writer import CompressionType
    from mcap_ros2.writer import Writer

    kind = {"zstd": CompressionType.ZSTD, "lz4": CompressionType.LZ4, "none": CompressionType.NONE}[compression]
    with open(path, "wb") as file:
        writer = Writer(file, compression=kind)
        schema = writer.register_msgdef("sensor_msgs/msg/Imu", IMU_DEFINITION)
        for k, ns in enumerate(time):
            writer.write_message("/imu/data", schema, imu_message(ns, accel[k], gyro[k]), log_time=ns, publish_time=ns)
        writer.finish()


def mcap_lz4(path, time, accel, gyro):
    mcap_ros2(path, time, accel, gyro, "lz4")


def mcap_plain(path, time, accel, gyro):
    mcap_ros2(path, time, accel, gyro, "none")


def mcap_json(path, time, accel, gyro):
    from mcap.writer import Writer

    with open(path, "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("Imu", "jsonschema", b'{"type": "object"}')
        channel = writer.register_channel("/imu", "json", schema)
        for k, ns in enumerate(time):
            message = imu_message(ns, accel[k], gyro[k])
            writer.add_message(channel, ns, json.dumps(message).encode(), ns)
        writer.finish()


def mcap_protobuf(path, time, accel, gyro):
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
    from mcap_protobuf.writer import Writer

    file = descriptor_pb2.FileDescriptorProto(name="imu.proto", package="lab", syntax="proto3")
    vector = file.message_type.add(name="Vector3")
    for number, name in enumerate("xyz", 1):
        vector.field.add(name=name, number=number, type=1, label=1)
    imu = file.message_type.add(name="Imu")
    imu.field.add(name="time", number=1, type=11, label=1, type_name=".google.protobuf.Timestamp")
    imu.field.add(name="angular_velocity", number=2, type=11, label=1, type_name=".lab.Vector3")
    imu.field.add(name="linear_acceleration", number=3, type=11, label=1, type_name=".lab.Vector3")
    file.dependency.append("google/protobuf/timestamp.proto")
    from google.protobuf import timestamp_pb2  # noqa: F401, registers it

    pool = descriptor_pool.Default()
    pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("lab.Imu"))
    with open(path, "wb") as out, Writer(out) as writer:
        for k, ns in enumerate(time):
            message = kind()
            message.time.seconds, message.time.nanos = ns // 10**9, ns % 10**9
            for of, values in ((message.angular_velocity, gyro[k]), (message.linear_acceleration, accel[k])):
                of.x, of.y, of.z = values
            writer.write_message("/imu", message, log_time=ns, publish_time=ns)


def bag(path, time, accel, gyro, compression=None):
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types = store.types
    imu, header = types["sensor_msgs/msg/Imu"], types["std_msgs/msg/Header"]
    stamp, vector = types["builtin_interfaces/msg/Time"], types["geometry_msgs/msg/Vector3"]
    quaternion = types["geometry_msgs/msg/Quaternion"]
    zeros = np.zeros(9)
    if os.path.exists(path):
        os.remove(path)
    writer = Writer(path)
    if compression:
        writer.set_compression(getattr(Writer.CompressionFormat, compression))
    with writer:
        connection = writer.add_connection("/imu", imu.__msgtype__, typestore=store)
        for k, ns in enumerate(time):
            head = header(seq=k, stamp=stamp(sec=ns // 10**9, nanosec=ns % 10**9), frame_id="imu")
            message = imu(
                header=head,
                orientation=quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
                orientation_covariance=zeros,
                angular_velocity=vector(*map(float, gyro[k])),
                angular_velocity_covariance=zeros,
                linear_acceleration=vector(*map(float, accel[k])),
                linear_acceleration_covariance=zeros,
            )
            writer.write(connection, ns, store.serialize_ros1(message, imu.__msgtype__))


def bag_lz4(path, time, accel, gyro):
    bag(path, time, accel, gyro, "LZ4")


def bag_bz2(path, time, accel, gyro):
    bag(path, time, accel, gyro, "BZ2")


def ulog(path, time, accel, gyro):
    """pyulog writes only what it has read: the format's own description, read again by pyulog."""
    message = lambda kind, content: struct.pack("<HB", len(content), ord(kind)) + content
    fields = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;float temperature;"
    with open(path, "wb") as file:
        file.write(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
        file.write(message("B", bytes(40)))
        for number, topic in enumerate(("sensor_gyro", "sensor_accel")):
            file.write(message("F", f"{topic}:{fields}".encode()))
        for number, topic in enumerate(("sensor_gyro", "sensor_accel")):
            file.write(message("A", struct.pack("<BH", 0, number) + topic.encode()))
        for k, ns in enumerate(time):
            us = (ns - START_NS) // 1000
            for number, values in enumerate((gyro[k], accel[k])):
                row = struct.pack("<HQQI4f", number, us + 300, us, 7, *values, 25.0)
                file.write(message("D", row))
    from pyulog import ULog

    again = ULog(path)
    assert sorted(data.name for data in again.data_list) == ["sensor_accel", "sensor_gyro"]
    assert len(again.get_dataset("sensor_gyro").data["x"]) == len(time)


def dataflash(path, time, accel, gyro):
    """pymavlink only reads it: the format's own description, read again by pymavlink."""
    fmt = lambda kind, length, name, types, labels: struct.pack(
        "<BBBBB4s16s64s", 0xA3, 0x95, 0x80, kind, length, name.encode(), types.encode(), labels.encode()
    )
    with open(path, "wb") as file:
        file.write(fmt(0x80, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"))
        file.write(fmt(0x81, 3 + 8 + 1 + 24, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"))
        for k, ns in enumerate(time):
            us = (ns - START_NS) // 1000
            file.write(struct.pack("<BBBQB6f", 0xA3, 0x95, 0x81, us, 0, *gyro[k], *accel[k]))
    from pymavlink import DFReader

    again = DFReader.DFReader_binary(path)
    first = again.recv_match(type="IMU")
    assert first.TimeUS == (time[0] - START_NS) // 1000 and first.GyrX == float(np.float32(gyro[0][0]))


FORMATS = {
    "npz": (npz, "s"),
    "deflated.npz": (npz_deflated, "s"),
    "npy": (npy, "s"),
    "mat": (mat, "s"),
    "plain.mat": (mat_plain, "s"),
    "v73.mat": (mat_of_hdf5, "s"),
    "h5": (hdf5, "s"),
    "mcap": (mcap_ros2, "ns"),
    "lz4.mcap": (mcap_lz4, "ns"),
    "plain.mcap": (mcap_plain, "ns"),
    "json.mcap": (mcap_json, "ns"),
    "proto.mcap": (mcap_protobuf, "ns"),
    "bag": (bag, "ns"),
    "lz4.bag": (bag_lz4, "ns"),
    "bz2.bag": (bag_bz2, "ns"),
    "ulg": (ulog, "ns"),
    "bin": (dataflash, "ns"),
}


def main():
    log, period, directory = sys.argv[1], float(sys.argv[2]), sys.argv[3]
    rows = np.loadtxt(log)
    accel, gyro = rows[:, :3], rows[:, 3:]
    ns = stamps(len(rows), period)
    for name in sys.argv[4:] or FORMATS:
        write, unit = FORMATS[name]
        path = os.path.join(directory, f"imu.{name}")
        time = ns if unit == "ns" else np.arange(1, len(rows) + 1) * period
        try:
            write(path, time, accel, gyro)
        except ImportError as error:
            print(f"skipped {name}: {error}")


main()
