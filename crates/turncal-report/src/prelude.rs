//! Common imports of all reports.

pub use serde_json::{Map, Value, json};

pub use super::document::{Block, Document, Facts, List, NONE, Table, capital, columns, joined};
pub use super::group::{
    Group, axis_name, function_name, group_columns, nominal_scale, short_name, triad_name,
};
pub use super::plot::{
    Anchor, Axis, Color, Dash, Fill, Mark, Panel, Plot, Point, Series, Shape, Upright, beside,
    positive_range, steps,
};
pub(crate) use crate::document::cells;
pub use turncal::number::*;
pub use turncal::units::*;
