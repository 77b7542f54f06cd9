//! Elements and attributes of an XML document, and names in it as messages show them.

use roxmltree::{Document, Node};

use crate::files::reader::shortened;

/// The line of the text where a node begins.
pub(super) fn line(document: &Document, node: Node) -> u32 {
    document.text_pos_at(node.range().start).row
}

/// The elements of a name directly below a node.
pub(super) fn children<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children().filter(move |child| child.is_element() && child.tag_name().name() == name)
}

/// The first of them.
pub(super) fn child<'a, 'i>(node: Node<'a, 'i>, name: &'static str) -> Option<Node<'a, 'i>> {
    children(node, name).next()
}

/// An attribute's text, empty if there is none.
pub(super) fn attribute<'a>(node: Node<'a, '_>, name: &str) -> &'a str {
    node.attribute(name).unwrap_or("").trim()
}

/// Longest name of a map in a message (characters).
const LONGEST_NAME: usize = 40;

/// A name of a map as messages show it: of bounded length, and without characters that a terminal would obey.
pub(super) fn shown(name: &str) -> String {
    shortened(&shortened(name, LONGEST_NAME).escape_debug().to_string(), 2 * LONGEST_NAME)
}
