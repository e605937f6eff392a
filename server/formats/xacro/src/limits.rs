//! Limits of an expansion.

/// Stack of an expansion, in bytes: pages that it does not use are not allocated.
pub(crate) const STACK_BYTES: usize = 64 << 20;
/// Bytes of one file.
pub(crate) const FILE_BYTES: u64 = 4 << 20;
/// Files, counting each reading.
pub(crate) const FILES: usize = 500;
/// Bytes of all files, counting each reading.
pub(crate) const ALL_BYTES: usize = 32 << 20;
/// Bytes of a YAML file.
pub(crate) const YAML_BYTES: u64 = 1 << 20;
/// XML nodes of one file.
pub(crate) const XML_NODES: u32 = 100_000;
/// Nesting depth of elements in a file.
pub(crate) const XML_DEPTH: usize = 100;
/// `=` signs between two `<`: the XML parser compares each attribute with each other one.
pub(crate) const XML_ATTRIBUTES: usize = 200;
/// Declarations of namespaces in a file.
pub(crate) const XML_NAMESPACES: usize = 256;
/// Nesting depth of elements, macros and includes.
pub(crate) const DEPTH: usize = 150;
/// Elements that are visited and parts of expressions that are computed.
pub(crate) const STEPS: usize = 2_000_000;
/// Bytes of the URDF.
pub(crate) const OUTPUT_BYTES: usize = 16 << 20;
/// Bytes of a value and of an expression.
pub(crate) const VALUE_BYTES: usize = 64 << 10;
/// Words and signs of an expression.
pub(crate) const WORDS: usize = 1_000;
/// Nesting depth of expressions, through all properties that they name.
pub(crate) const EXPRESSION_DEPTH: usize = 400;
/// Entries of a list.
pub(crate) const ENTRIES: usize = 10_000;
/// Nesting depth of brackets, in an expression and in YAML.
pub(crate) const BRACKETS: usize = 40;
/// Maximum number of kept messages.
pub(crate) const MESSAGES: usize = 100;
