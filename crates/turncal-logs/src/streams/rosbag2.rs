//! ROS 2 bags as SQLite files: `topics`, `messages` and, from ROS 2 Iron on, `message_definitions`.
//!
//! Source: rosbag2, `rosbag2_storage_sqlite3`, `sqlite_storage.cpp`.

use std::collections::BTreeMap;

use super::Log;
use super::bytes::{Broken, Input};
use super::messages::{MessageLog, Messages, Reader, Topics, ros::Encoding};
use super::sqlite::{Database, Row, Table};

/// Definition of `sensor_msgs/msg/Imu`, missing in earlier bags.
const IMU: &str = "std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
====
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
====
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
====
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
";

struct Bag {
    database: Database,
    messages: Table,
    /// The row of the message.
    current: Row,
}

pub fn open(input: Input) -> Result<Box<dyn Log>, Broken> {
    let mut database = Database::open(input)?;
    let mut definitions = BTreeMap::from([("sensor_msgs/msg/Imu".to_owned(), IMU.to_owned())]);
    if let Some(mut table) = database.table("message_definitions")? {
        while let Some(row) = database.next(&mut table)? {
            let text = row.get("encoded_message_definition").text();
            if row.get("encoding").bytes() == b"ros2msg" {
                definitions.insert(row.get("topic_type").text(), text);
            }
        }
    }
    let missing = |name| Broken::new(0, format!("no table `{name}`"), "a ROS 2 bag");
    let mut topics = Topics::default();
    let mut table = database.table("topics")?.ok_or_else(|| missing("topics"))?;
    while let Some(row) = database.next(&mut table)? {
        let (kind, encoding) = (
            row.get("type").text(),
            row.get("serialization_format").text(),
        );
        let reader = || match definitions.get(&kind).filter(|_| encoding == "cdr") {
            Some(definition) => Reader::of_ros(&kind, definition, Encoding::Cdr),
            None => Reader::Unknown(format!(
                "turncal cannot read messages `{kind}` of encoding `{encoding}` because the bag does not define them"
            )),
        };
        let number = row.get("id").whole().unwrap_or(0) as u32;
        topics.add(number, &row.get("name").text(), reader);
    }
    let messages = database.table("messages")?;
    let messages = Bag {
        messages: messages.ok_or_else(|| missing("messages"))?,
        database,
        current: Row::default(),
    };
    Ok(Box::new(MessageLog::new(messages, topics)))
}

impl Messages for Bag {
    fn advance(&mut self, _: &mut Topics) -> Result<Option<(u32, u64)>, Broken> {
        let Some(row) = self.database.next(&mut self.messages)? else {
            return Ok(None);
        };
        self.current = row;
        let whole = |column| self.current.get(column).whole().unwrap_or(0);
        Ok(Some((whole("topic_id") as u32, whole("timestamp") as u64)))
    }

    fn data(&self) -> &[u8] {
        self.current.get("data").bytes()
    }

    fn offset(&self) -> u64 {
        self.current.offset
    }
}
