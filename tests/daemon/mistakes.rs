//! Mistakes of an operator: one sentence on stderr, and the exit code that `simd --help` documents.

use std::net::TcpListener;

use simd_tests::process::{Home, Said};

use crate::transcript::{Transcript, assert_snapshot};

/// Runs `simd` with a mistake. The log before the sentence is left out.
async fn refused(home: &Home, arguments: &[&str]) -> Said {
    // Daemons of other tests would be in the way at the default locator.
    let mut said = home.run("simd", ["--zenoh", "off"].iter().chain(arguments)).await;
    assert_eq!(said.out, "", "{arguments:?}: a daemon that does not start is silent on stdout");
    let (sentences, log): (Vec<&str>, Vec<&str>) =
        said.err.lines().partition(|line| !line.contains(" INFO "));
    assert!(log.iter().all(|line| line.contains(" simd_")), "{log:?}");
    assert_eq!(sentences.len(), 1, "{arguments:?}: {sentences:?}");
    assert!(sentences[0].starts_with("simd: "), "{sentences:?}");
    said.err = format!("{}\n", sentences[0]);
    said
}

/// Returns a transcript of lines that are each refused with `code`.
async fn transcript(home: &Home, code: i32, lines: &[Vec<&str>]) -> Transcript {
    let mut transcript = Transcript::default();
    for line in lines {
        let said = refused(home, line).await;
        assert_eq!(said.code, code, "{line:?}: {}", said.err);
        transcript.add(&format!("simd {}", line.join(" ")), &said);
    }
    transcript
}

#[tokio::test]
async fn a_bad_flag_is_named_in_one_sentence_and_exits_with_2() {
    let lines = [
        "--lisen 127.0.0.1:0",
        "--listen here",
        "--listen 0.0.0.0:7400",
        "--rtf fast",
        "--rtf 0",
        "--time-step 1",
        "--gravity 0,0",
        "--name two_words!",
        "--log simd=loud",
        "--asset-root nowhere",
        "--load",
        "--zenoh-connect here",
        "robot.urdf",
    ];
    let lines: Vec<Vec<&str>> = lines.iter().map(|line| line.split(' ').collect()).collect();
    let transcript = transcript(&Home::new(), 2, &lines).await;
    assert_snapshot("bad_flags", transcript.text(), &[]);
}

#[tokio::test]
async fn a_bad_configuration_file_is_named_with_its_line_and_exits_with_3() {
    let home = Home::new();
    let files = [
        ("unknown_key.toml", "name = \"lab\"\ntimestep = 0.001\n"),
        ("wrong_type.toml", "[physics]\nreal_time_factor = \"fast\"\n"),
        ("out_of_range.toml", "[physics]\ntime_step = 1.0\n"),
        ("no_path.toml", "[[robots]]\nname = \"arm\"\n"),
        ("no_toml.toml", "name is lab\n"),
        ("exposed.toml", "listen = \"192.168.0.1:7400\"\n"),
    ];
    let mut lines = Vec::new();
    for (name, text) in files {
        std::fs::write(home.path().join(name), text).unwrap();
        lines.push(home.path().join(name).display().to_string());
    }
    lines.push(home.path().join("missing.toml").display().to_string());
    lines.push(home.path().display().to_string());
    let lines: Vec<Vec<&str>> = lines.iter().map(|path| vec!["--config", path]).collect();
    let transcript = transcript(&home, 3, &lines).await;
    assert_snapshot("bad_files", transcript.text(), &[]);
}

#[tokio::test]
async fn a_used_port_exits_with_4() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let transcript = transcript(&Home::new(), 4, &[vec!["--listen", &address]]).await;
    assert_snapshot("used_port", transcript.text(), &[]);
}

#[tokio::test]
async fn a_robot_that_cannot_be_loaded_at_the_start_exits_with_5() {
    let home = Home::new();
    let folder = home.path();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    write("broken.urdf", "<robot name=\"arm\">\n  <link name=\"base\">\n</robot>\n");
    write("no_robot.urdf", "<sdf/>\n");
    let link = |name: &str| format!("<link name=\"{name}\"/>");
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            "<joint name=\"{name}\" type=\"fixed\"><parent link=\"{parent}\"/><child link=\"{child}\"/></joint>"
        )
    };
    let two_roots = link("a") + &link("b");
    write("two_roots.urdf", &format!("<robot name=\"r\">{two_roots}</robot>"));
    let looped = link("a") + &link("b") + &joint("j", "a", "b") + &joint("k", "b", "a");
    write("loop.urdf", &format!("<robot name=\"r\">{looped}</robot>"));
    write("arm.xacro", "<robot/>");
    std::fs::create_dir(folder.join("empty_package")).unwrap();
    let names = [
        "broken.urdf",
        "no_robot.urdf",
        "two_roots.urdf",
        "loop.urdf",
        "arm.xacro",
        "empty_package",
        "missing",
    ];
    let paths: Vec<String> = names.iter().map(|name| folder.join(name).display().to_string()).collect();
    let lines: Vec<Vec<&str>> =
        paths.iter().map(|path| vec!["--listen", "127.0.0.1:0", "--load", path]).collect();
    let transcript = transcript(&home, 5, &lines).await;
    assert_snapshot("bad_robots", transcript.text(), &[]);
}

/// A check finds whatever a start would refuse, except for addresses that are in use.
#[tokio::test]
async fn a_check_refuses_what_a_start_refuses_in_the_same_words() {
    let home = Home::new();
    let robot = |more: &str| {
        let arm = simd_tests::robots::assets().join("Bench_Arm-1.2 rev B");
        format!("[[robots]]\npath = \"{}\"\nfixed = true\n{more}\n", arm.display())
    };
    let files = [
        ("unknown_joint.toml", robot("positions = { wrist = 0.5 }")),
        ("two_of_one_name.toml", robot("name = \"arm\"") + &robot("name = \"arm\"")),
        ("missing_robot.toml", "[[robots]]\npath = \"nowhere\"\n".to_owned()),
        ("no_folder.toml", "[recording]\ndirectory = \"missing\"\n".to_owned()),
        ("no_folder_of_autosave.toml", "[autosave]\nfile = \"missing/world.simdstate\"\n".to_owned()),
        ("empty_tokens.toml", "tokens = \"missing\"\n".to_owned()),
    ];
    for (name, text) in files {
        let path = home.path().join(name);
        std::fs::write(&path, text).unwrap();
        let path = path.to_str().unwrap();
        let started = refused(&home, &["--listen", "127.0.0.1:0", "--config", path]).await;
        let checked = home.run("simd", ["config", "check", path]).await;
        assert_eq!((checked.code, &checked.err), (3, &started.err), "{name}");
    }
    let path = home.path().join("right.toml");
    std::fs::write(&path, robot("positions = { shoulder = 0.5 }")).unwrap();
    let checked = home.run("simd", ["config", "check", path.to_str().unwrap()]).await;
    assert_eq!(checked.code, 0, "{}", checked.err);
}
