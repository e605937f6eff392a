//! How far an expansion may go.

/// Bytes of the stack that an expansion runs on: pages that it does not use are not taken.
pub(crate) const STACK_BYTES: usize = 64 << 20;
/// Bytes of one file.
pub(crate) const FILE_BYTES: u64 = 4 << 20;
/// Files, each reading of one counted.
pub(crate) const FILES: usize = 500;
/// Bytes of all files, each reading of one counted.
pub(crate) const ALL_BYTES: usize = 32 << 20;
/// Bytes of a YAML file.
pub(crate) const YAML_BYTES: u64 = 1 << 20;
/// XML nodes of one file.
pub(crate) const XML_NODES: u32 = 100_000;
/// Elements inside one another, in a file.
pub(crate) const XML_DEPTH: usize = 100;
/// `=` signs between two `<`: the XML parser compares each attribute with each other one.
pub(crate) const XML_ATTRIBUTES: usize = 200;
/// Declarations of namespaces in a file.
pub(crate) const XML_NAMESPACES: usize = 256;
/// Elements, macros and includes inside one another.
pub(crate) const DEPTH: usize = 150;
/// Elements that are looked at and parts of expressions that are computed.
pub(crate) const STEPS: usize = 2_000_000;
/// Bytes of the URDF.
pub(crate) const OUTPUT_BYTES: usize = 16 << 20;
/// Bytes of a value and of an expression.
pub(crate) const VALUE_BYTES: usize = 64 << 10;
/// Words and signs of an expression.
pub(crate) const WORDS: usize = 1_000;
/// Parts of expressions inside one another, through all properties that they name.
pub(crate) const EXPRESSION_DEPTH: usize = 400;
/// Entries of a list.
pub(crate) const ENTRIES: usize = 10_000;
/// Brackets inside one another, in an expression and in YAML.
pub(crate) const BRACKETS: usize = 40;
/// Messages that are kept.
pub(crate) const MESSAGES: usize = 100;
