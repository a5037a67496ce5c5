//! A TOML document written line by line, with a remark for each field.

use std::fmt::Display;

use toml::Value;

/// The lines so far, and the open fields.
#[derive(Debug)]
pub struct Page {
    pub text: String,
    /// The fields that are open, each with the reason.
    pub open: Vec<(String, String)>,
}

impl Page {
    /// A document of this format, with an initial remark.
    pub fn of(format: &str, remark: &str) -> Self {
        let (text, open) = (String::new(), Vec::new());
        let mut page = Self { text, open };
        if !remark.is_empty() {
            page.remark(remark);
        }
        page.field("format", format);
        page
    }

    /// A table header after a remark.
    pub fn table(&mut self, name: &str, remark: &str) {
        self.text.push('\n');
        if !remark.is_empty() {
            self.remark(remark);
        }
        self.text += &format!("[{name}]\n");
    }

    pub fn field(&mut self, key: &str, value: impl Into<Value>) {
        self.plain(key, value.into());
    }

    /// A field if its value is known.
    pub fn known(&mut self, key: &str, value: Option<impl Into<Value>>) {
        if let Some(value) = value {
            self.field(key, value);
        }
    }

    /// A field whose value is TOML.
    pub fn plain(&mut self, key: &str, value: impl Display) {
        self.text += &format!("{key} = {value}\n");
    }

    /// The same with a reason.
    pub fn line(&mut self, key: &str, value: impl Display, why: impl Display) {
        self.text += &format!("{key} = {value}  # {why}\n");
    }

    /// An optional field.
    pub fn optional(&mut self, key: &str, why: &str) {
        self.remark(format_args!("{key} =  # {why}"));
    }

    /// A partly known field that must be completed.
    pub fn open(&mut self, field: &str, why: impl Display) {
        let gap = if field.is_empty() { "" } else { "  # " };
        self.remark(format_args!("{field}{gap}TODO: {why}"));
        let key = field.split('=').next().unwrap_or_default().trim();
        self.open.push((key.to_owned(), why.to_string()));
    }

    pub fn remark(&mut self, remark: impl Display) {
        self.text += &format!("# {remark}\n");
    }
}
