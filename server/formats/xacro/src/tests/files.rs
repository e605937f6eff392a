//! Files that a xacro file includes and reads.

use super::*;

/// Returns a package with a robot and the files that it includes and reads.
fn package(files: &[(&str, &str)]) -> TempDir {
    let dir = TempDir::new().unwrap();
    for (path, text) in files {
        let path = dir.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    dir
}

fn expand_in(dir: &TempDir, path: &str) -> Result<Expanded, Error> {
    let path = dir.path().join(path);
    expand(&path, &BTreeMap::new(), &Locator::new(&path))
}

#[test]
fn files_are_included_by_package_and_from_their_own_folder() {
    let top = robot(
        "<xacro:include filename=\"$(find arm)/urdf/inc/macros.xacro\"/>\n<xacro:arm prefix=\"left_\"/>\n\
         <xacro:include filename=\"none.xacro\" optional=\"true\"/>",
    );
    let macros = robot(
        "<xacro:include filename=\"../common.xacro\"/>\n<xacro:macro name=\"arm\" params=\"prefix\">\n<link name=\"${prefix}base\">\n\
         <visual><geometry><mesh filename=\"file://$(find arm)/meshes/a.dae\" scale=\"${s} ${s} ${s}\"/></geometry></visual>\n</link>\n</xacro:macro>",
    );
    let common = robot("<xacro:property name=\"s\" value=\"0.001\"/>");
    let dir = package(&[
        ("arm/package.xml", "<package><name>arm</name></package>"),
        ("arm/urdf/arm.urdf.xacro", &top),
        ("arm/urdf/inc/macros.xacro", &macros),
        ("arm/urdf/common.xacro", &common),
    ]);
    let expanded = expand_in(&dir, "arm/urdf/arm.urdf.xacro").unwrap();
    let mesh = "<mesh filename=\"package://arm/meshes/a.dae\" scale=\"0.001 0.001 0.001\"/>";
    assert!(expanded.urdf.contains(mesh), "{}", expanded.urdf);
    let line = expanded.urdf.lines().position(|line| line == mesh).unwrap() as u32 + 1;
    let (file, line) = expanded.source(line).unwrap();
    assert!(file.ends_with("inc/macros.xacro"));
    assert_eq!(line, 5);
    assert_eq!(expanded.files.len(), 3);
}

#[test]
fn nothing_is_read_outside_of_packages_and_of_other_kinds_of_files() {
    let includes = |name: &str| robot(&format!("<xacro:include filename=\"{name}\"/>"));
    let yaml = robot("<x y=\"${xacro.load_yaml('../../secret/a.yaml')['a']}\"/>");
    let dir = package(&[
        ("arm/package.xml", "<package><name>arm</name></package>"),
        ("arm/urdf/out.xacro", &includes("../../secret/a.xacro")),
        ("arm/urdf/key.xacro", &includes("../id_rsa")),
        ("arm/urdf/yaml.xacro", &yaml),
        ("arm/urdf/net.xacro", &includes("https://example.org/a.xacro")),
        ("arm/id_rsa", "<robot/>"),
        ("secret/a.xacro", "<robot/>"),
        ("secret/a.yaml", "a: 1"),
    ]);
    let of = |path: &str| expand_in(&dir, path).unwrap_err().to_string();
    assert!(of("arm/urdf/out.xacro").contains("absolute path outside"), "{}", of("arm/urdf/out.xacro"));
    assert!(of("arm/urdf/key.xacro").contains("is not a xacro or YAML file"), "{}", of("arm/urdf/key.xacro"));
    assert!(of("arm/urdf/yaml.xacro").contains("absolute path outside"), "{}", of("arm/urdf/yaml.xacro"));
    assert!(of("arm/urdf/net.xacro").contains("nothing is fetched"), "{}", of("arm/urdf/net.xacro"));
}

#[test]
fn a_file_that_includes_itself_is_refused() {
    let dir = package(&[("urdf/a.xacro", &robot("<xacro:include filename=\"a.xacro\"/>"))]);
    let refused = expand_in(&dir, "urdf/a.xacro").unwrap_err().to_string();
    assert!(refused.contains("nested deeper than 150: this file includes itself"), "{refused}");
}

#[test]
fn a_missing_package_or_an_empty_name_is_the_fault_that_is_named() {
    let include = |name: &str| {
        robot(&format!("<xacro:arg name='config' default=''/>\n<xacro:include filename=\"{name}\"/>"))
    };
    let dir = package(&[
        ("package.xml", "<package><name>arm</name></package>"),
        ("urdf/a.xacro", &include("$(find other)/urdf/a.xacro")),
        ("urdf/b.xacro", &include("$(arg config)")),
        ("urdf/c.xacro", &robot("<x y=\"${xacro.load_yaml('')['a']}\"/>")),
    ]);
    for (file, fault) in [
        ("urdf/a.xacro", "the package \"other\" is not found"),
        ("urdf/b.xacro", "the name of the file is empty, in \"$(arg config)\""),
        ("urdf/c.xacro", "the name of the file is empty, in ${"),
    ] {
        let refused = expand_in(&dir, file).unwrap_err().to_string();
        assert!(refused.contains(fault), "{refused}");
    }
}

#[test]
fn the_callers_stack_does_not_limit_the_depth() {
    let dir = package(&[("urdf/a.xacro", &robot("<xacro:include filename=\"a.xacro\"/>"))]);
    let small = std::thread::Builder::new().stack_size(256 << 10);
    let caller = small.spawn(move || expand_in(&dir, "urdf/a.xacro").unwrap_err().to_string()).unwrap();
    assert!(caller.join().unwrap().contains("nested deeper than 150"));
}

#[test]
fn yaml_gives_maps_lists_numbers_and_angles() {
    let config = "# limits\n---\njoints:\n  elbow:\n    max: !degrees 180.0 # half\n    has: true\n    name: \"it's #1\"\n  list:\n  - 1\n  - {a: 2, b: [x, 'y z']}\nflow: [1.5, 2,\n  3]\nempty:\ntext: plain words\n";
    let top = robot(
        "<xacro:property name='c' value=\"${xacro.load_yaml('c.yaml')}\"/><xacro:property name='j' value=\"${c['joints']}\"/>\
         <x a=\"${j['elbow']['max'] == pi}\" b=\"${j.elbow.has}\" c=\"${j.elbow.name}\" d=\"${j.list[1].b[1]}\" e=\"${c.flow}\" f=\"${c.empty}\" g=\"${c.text}\"/>",
    );
    let dir = package(&[("urdf/a.xacro", &top), ("urdf/c.yaml", config)]);
    let urdf = expand_in(&dir, "urdf/a.xacro").unwrap().urdf;
    let expected =
        "<x a=\"True\" b=\"True\" c=\"it's #1\" d=\"y z\" e=\"[1.5, 2, 3]\" f=\"None\" g=\"plain words\"/>";
    assert!(urdf.contains(expected), "{urdf}");
}

fn read_yaml(text: &str) -> Result<(value::Value, usize), String> {
    yaml::read(text, &mut |text| text.parse().map_err(|_| format!("{text} is not a number")))
}

/// Reads a YAML file; returns it as Python shows it.
fn yaml_of(text: &str) -> String {
    read_yaml(text).unwrap().0.show().unwrap()
}

#[test]
fn yaml_has_anchors_and_the_last_of_equal_keys_holds() {
    for (text, expected) in [
        ("left: &f\n  m: 3\nright: *f", "{'left': {'m': 3}, 'right': {'m': 3}}"),
        ("a: &x 1\nb: [*x, 2]", "{'a': 1, 'b': [1, 2]}"),
        ("a: &x {b: 1, c: 2}\nd:\n  <<: *x\n  c: 3", "{'a': {'b': 1, 'c': 2}, 'd': {'c': 3, 'b': 1}}"),
        ("- &x\n  a: 1\n- *x", "[{'a': 1}, {'a': 1}]"),
        ("link:\n  inertia:\n  inertia:\n    xx: 5", "{'link': {'inertia': {'xx': 5}}}"),
        ("{a: 1, b: 2, a: 3}", "{'a': 3, 'b': 2}"),
        ("a: |\n  one\n   two\n\nb: >-\n  three\n  four\n", "{'a': 'one\n two\n', 'b': 'three four'}"),
        ("a: one\n  two\nb: \"x\\ty\"\nc: 'it''s'", "{'a': 'one two', 'b': 'x\ty', 'c': \"it's\"}"),
        ("a: !millimeters 250\nb: !!str 5", "{'a': 0.25, 'b': '5'}"),
    ] {
        assert_eq!(yaml_of(text), expected, "{text}");
    }
}

#[test]
fn yaml_that_names_itself_repeatedly_is_refused() {
    let mut bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x]\n".to_owned();
    for level in 1..30 {
        let alias = format!("*a{}", level - 1);
        bomb += &format!("a{level}: &a{level} [{0}, {0}, {0}, {0}, {0}, {0}, {0}, {0}, {0}]\n", alias);
    }
    assert!(read_yaml(&bomb).unwrap_err().contains("more than 10000 values"));
}

#[test]
fn yaml_that_grows_or_is_not_supported_is_refused_with_its_line() {
    for (text, reason) in [
        ("a: 1\nb: *x", "line 2: no anchor is named \"x\""),
        ("a: |2\n  b", "line 1: not supported: \"|2\" in YAML"),
        ("a: 'b\nc: 1", "has no closing quote"),
        ("a: !!python/object 1", "line 1: not supported: the tag !!python/object"),
        ("a: [1, 2", "line 1: \"[1, 2\" has no closing bracket"),
        ("a: 1\n   b: 2", "line 2: the indentation fits nothing before it"),
        ("a: 1\nb", "line 2: \"b\" has no `:`"),
        ("a: 1\n---\nb: 2", "line 2: not supported: a second document"),
    ] {
        let why = read_yaml(text).unwrap_err();
        assert!(why.contains(reason), "{text}: {why}");
    }
    let deep = "[".repeat(50) + &"]".repeat(50);
    assert!(read_yaml(&deep).unwrap_err().contains("nested deeper than 40"));
    let dashes = "- ".repeat(50) + "1";
    assert!(read_yaml(&dashes).unwrap_err().contains("nested deeper than 40"));
    assert!(read_yaml(&"- 1\n".repeat(10_001)).unwrap_err().contains("more than 10000 values"));
    assert!(read_yaml(&"- 1\n".repeat(10_000)).is_ok());
}

#[test]
fn a_mistake_in_an_included_file_is_reported_with_that_file_and_line() {
    let dir = package(&[
        ("urdf/a.xacro", &robot("<xacro:include filename=\"b.xacro\"/>\n<xacro:m/>")),
        ("urdf/b.xacro", &robot("<xacro:macro name=\"m\">\n<x y=\"${nothing}\"/>\n</xacro:macro>")),
    ]);
    let error = expand_in(&dir, "urdf/a.xacro").unwrap_err();
    assert!(error.file.as_ref().unwrap().ends_with("urdf/b.xacro"));
    assert_eq!((error.line, error.message.as_str()), (3, "\"nothing\" is not defined, in ${nothing}"));
}

#[test]
fn an_include_may_have_a_namespace() {
    let child = "<xacro:property name='tip' value='tool'/><xacro:macro name='m' params='n'>\
        <link name='${tip}_${n}'/></xacro:macro>";
    let top = "<xacro:property name='file' value='child.xacro'/><xacro:include filename='${file}' ns='child'/>\
        <link name='${child.tip}'/><xacro:child.m n='1'/>";
    let dir = package(&[("urdf/a.xacro", &robot(top)), ("urdf/child.xacro", &robot(child))]);
    let urdf = expand_in(&dir, "urdf/a.xacro").unwrap().urdf;
    assert!(urdf.contains("<link name=\"tool\"/>\n<link name=\"tool_1\"/>"), "{urdf}");
    let outside = robot("<xacro:include filename='child.xacro' ns='child'/><link name='${tip}'/>");
    let dir = package(&[("urdf/a.xacro", &outside), ("urdf/child.xacro", &robot(child))]);
    assert!(expand_in(&dir, "urdf/a.xacro").unwrap_err().message.contains("\"tip\" is not defined"));
}

#[test]
fn an_include_may_be_a_pattern() {
    let dir = package(&[
        (
            "urdf/a.xacro",
            &robot("<xacro:include filename='parts/*.xacro'/><xacro:include filename='none*'/>"),
        ),
        ("urdf/parts/b.xacro", &robot("<link name='b'/>")),
        ("urdf/parts/a.xacro", &robot("<link name='a'/>")),
        ("urdf/parts/a.txt", "no xacro"),
    ]);
    let expanded = expand_in(&dir, "urdf/a.xacro").unwrap();
    assert!(expanded.urdf.contains("<link name=\"a\"/>\n<link name=\"b\"/>"), "{}", expanded.urdf);
    assert_eq!(expanded.messages, ["no file is called \"none*\""]);
}

#[test]
fn a_file_in_a_macro_is_named_from_the_folder_of_the_call_else_of_the_macro() {
    let sizes = "<xacro:macro name='m'><link name=\"${xacro.load_yaml('sizes.yaml')['a']}\"/></xacro:macro>";
    let top = robot("<xacro:include filename='inc/m.xacro'/><xacro:m/>");
    let all = [
        ("urdf/a.xacro", top.as_str()),
        ("urdf/inc/m.xacro", &robot(sizes)),
        ("urdf/inc/sizes.yaml", "a: macro"),
        ("urdf/sizes.yaml", "a: call"),
    ];
    assert!(expand_in(&package(&all), "urdf/a.xacro").unwrap().urdf.contains("<link name=\"call\"/>"));
    let without = all.get(..3).unwrap();
    assert!(expand_in(&package(without), "urdf/a.xacro").unwrap().urdf.contains("<link name=\"macro\"/>"));
}
