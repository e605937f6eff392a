//! Descriptions with other addresses of their meshes.

use crate::limits::LoadLimits;
use crate::urdf::{describe, readdress};

/// The text with each mesh at `/assets/` and its number.
fn rewritten(urdf: &[u8]) -> String {
    let known = describe(urdf, &LoadLimits::default()).unwrap().asset_uris;
    let address = |uri: &str| known.iter().position(|at| at == uri).map(|n| format!("/assets/{n}.stl"));
    readdress(urdf, &LoadLimits::default(), &address).unwrap()
}

#[test]
fn only_the_file_names_of_meshes_change() {
    let urdf = r#"<robot name="r"> <!-- filename="a.stl" -->
  <link name="l" filename="a.stl">
    <visual><geometry><mesh scale="1 2 3"   filename = 'a &amp; b.stl'/></geometry></visual>
    <collision><geometry><mesh filename="a.stl" scale="1 1 1"/></geometry></collision>
    <visual><geometry><mesh filename="a &amp; b.stl"/></geometry></visual>
    <sensor><mesh filename="a.stl"/></sensor>
  </link>
</robot>
"#;
    let expected = urdf
        .replace("filename = 'a &amp; b.stl'", "filename=\"/assets/0.stl\"")
        .replace("mesh filename=\"a &amp; b.stl\"", "mesh filename=\"/assets/0.stl\"")
        .replace("geometry><mesh filename=\"a.stl\"", "geometry><mesh filename=\"/assets/1.stl\"");
    assert_eq!(rewritten(urdf.as_bytes()), expected);
}

#[test]
fn what_an_address_holds_is_escaped() {
    let urdf = r#"<robot name="r"><link name="l"><visual><geometry><mesh filename="a"/></geometry></visual></link></robot>"#;
    let hostile = "\"/><evil a='&amp;'>\n\u{e4}";
    let text = readdress(urdf.as_bytes(), &LoadLimits::default(), &|_| Some(hostile.to_owned())).unwrap();
    assert_eq!(describe(text.as_bytes(), &LoadLimits::default()).unwrap().asset_uris, [hostile]);
    let kept = readdress(urdf.as_bytes(), &LoadLimits::default(), &|_| None).unwrap();
    assert_eq!(kept, urdf);
}

#[test]
fn text_in_another_encoding_is_utf_8_afterwards() {
    let urdf = "<?xml version=\"1.0\" encoding=\"utf-16\"?>\n<robot name=\"\u{e4}\"><link name=\"l\"><visual>\
                <geometry><mesh filename=\"\u{fc}.stl\"/></geometry></visual></link></robot>";
    let wide: Vec<u8> =
        std::iter::once(0xfeff).chain(urdf.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let text = rewritten(&wide);
    assert!(text.contains("name=\"\u{e4}\"") && text.contains("filename=\"/assets/0.stl\""), "{text}");
    assert!(!text.contains("utf-16"));
    assert_eq!(describe(text.as_bytes(), &LoadLimits::default()).unwrap().asset_uris, ["/assets/0.stl"]);
}
