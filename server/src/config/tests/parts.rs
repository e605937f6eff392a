//! Tables of the configuration: limits, connections, ROS 2, and the folder of the state.

use super::*;

#[test]
fn limits_are_set_one_by_one_and_checked() {
    let before = Config::default().limits;
    let text = "[limits]\nurdf_bytes = 1000\nlinks = 7\nxml_nodes = 9\nmesh_bytes = 4096\nseconds = 2.5\n";
    let limits = file(text, "").unwrap().limits;
    assert_eq!((limits.reading.urdf_bytes, limits.description_bytes), (1000, 1000));
    assert_eq!((limits.reading.links, limits.links, limits.reading.xml_nodes), (7, 7, 9));
    assert_eq!((limits.reading.mesh_bytes, limits.asset_bytes), (4096, 4096));
    assert_eq!(limits.reading.time, std::time::Duration::from_millis(2500));
    assert_eq!(limits.reading.shapes, before.reading.shapes);
    assert_eq!(file("", "").unwrap().limits.description_bytes, before.description_bytes);
    for (line, mistake) in [
        ("links = 0", "limits.links is 0; it must be between 1 and 10000"),
        ("mesh_triangles = 2000001", "limits.mesh_triangles is 2000001; it must be between 0 and 2000000"),
        ("seconds = -1", "limits.seconds is -1; it must be between 0 and 86400"),
        ("joints = 3", "there is no key"),
    ] {
        let sentence = file_mistake(&format!("[limits]\n{line}\n"));
        assert!(sentence.contains(mistake), "{sentence}");
    }
}

#[test]
fn limits_of_connections_are_set_one_by_one_and_checked() {
    let text =
        "[connections]\nmax = 100\nloopback_reserve = 3\nidle_seconds = 1.5\nbody_bytes_per_second = 7\n";
    let limits = file(text, "").unwrap().connections;
    let expected = Connections {
        max: 100,
        // Never more than the total.
        max_per_peer: 100,
        max_http1: 100,
        loopback_reserve: 3,
        idle: std::time::Duration::from_millis(1500),
        body_bytes_per_second: 7,
        ..Connections::default()
    };
    assert_eq!(limits, expected);
    assert_eq!(file("", "").unwrap().connections, Connections::default());
    for (line, mistake) in [
        ("max = 1", "connections.max is 1; it must be between 2 and 65536"),
        ("max_per_peer = 0", "connections.max_per_peer is 0; it must be between 1 and 65536"),
        (
            "max_per_peer = 513",
            "connections.max_per_peer is 513; it must be at most 512 if connections.max is 512",
        ),
        (
            "loopback_reserve = 512",
            "connections.loopback_reserve is 512; it must be at most 511 if connections.max is 512",
        ),
        ("max_http1 = 0", "connections.max_http1 is 0; it must be between 1 and 65536"),
        ("idle_seconds = 0", "connections.idle_seconds is 0; it must be between 0.1 and 604800"),
        ("body_seconds = nan", "connections.body_seconds is NaN; it must be between 0.1 and 604800"),
        ("body_bytes_per_second = 0", "connections.body_bytes_per_second is 0; it must be between 1 and"),
        ("maximum = 3", "there is no key"),
    ] {
        let sentence = file_mistake(&format!("[connections]\n{line}\n"));
        assert!(sentence.contains(mistake), "{sentence}");
    }
}

#[test]
fn a_node_of_ros_2_is_off_until_it_is_asked_for_and_its_router_has_the_port_for_itself() {
    assert!(!args("").unwrap().ros2.enabled);
    let config = args("--ros2 --zenoh off").unwrap();
    assert!(config.ros2.enabled && config.ros2.router == "tcp/localhost:7447");
    args("--ros2 --zenoh tcp/127.0.0.1:7448").unwrap();
    assert!(usage("--ros2").contains("--zenoh tcp/127.0.0.1:7448"), "{}", usage("--ros2"));
}

#[test]
fn mistakes_about_ros_2_name_the_key() {
    for (text, part) in [
        ("[ros2]\nrate = 0", "ros2.rate is 0"),
        ("[ros2]\nrate = nan", "ros2.rate is NaN"),
        ("[ros2]\ndomain_id = 233", "ros2.domain_id is 233"),
        ("[ros2]\nnamespace = \"lab\"", "ros2.namespace is \"lab\""),
        ("[ros2]\nrouter = \"localhost\"", "is not a Zenoh locator"),
        ("[ros2]\nrouter = '\"tcp/127.0.0.1:7447\"'", "is not a Zenoh locator"),
        ("[ros2]\ndistro = \"foxy\"", "foxy"),
    ] {
        let sentence = file_mistake(text);
        assert!(sentence.contains(part), "{text}: {sentence}");
    }
}

#[test]
fn the_folder_of_the_state_is_the_services_else_the_users() {
    let read = |variables: &[(&str, &str)], flags: &str| {
        let args = std::iter::once("simd").chain(flags.split_whitespace()).map(OsString::from);
        let variables: Vec<_> = variables.iter().map(|(name, value)| (name.into(), value.into())).collect();
        Config::read(args, variables)
    };
    let recordings = |variables: &[(&str, &str)]| read(variables, "").unwrap().recording.directory;
    let (service, user, home) = (
        ("STATE_DIRECTORY", "/var/lib/simd:/var/lib/other"),
        ("XDG_STATE_HOME", "/state"),
        ("HOME", "/home/me"),
    );
    assert_eq!(recordings(&[service, user, home]), Some("/var/lib/simd/recordings".into()));
    assert_eq!(recordings(&[user, home]), Some("/state/simd/recordings".into()));
    assert_eq!(
        recordings(&[("XDG_STATE_HOME", "relative"), home]),
        Some("/home/me/.local/state/simd/recordings".into())
    );
    assert_eq!(recordings(&[]), None);
    let autosave = |flags: &str| read(&[service], flags).unwrap().autosave.map(|autosave| autosave.file);
    assert_eq!(autosave(""), None);
    assert_eq!(autosave("--autosave --name lab"), Some("/var/lib/simd/lab.simdstate".into()));
    assert_eq!(autosave("--set autosave.restore=true"), Some("/var/lib/simd/simd.simdstate".into()));
    assert_eq!(autosave("--set autosave.file=/srv/world"), Some("/srv/world".into()));
    let lost = read(&[], "--autosave").unwrap_err().to_string();
    assert!(lost.contains("autosave.file") && lost.contains("XDG_STATE_HOME"), "{lost}");
}
