//! A second run beside the recorded one, with changes.

use std::cell::RefCell;
use std::io::Write;
use std::rc::Rc;

use super::*;
use crate::recording::replay_beside;

/// A table that the test reads.
#[derive(Clone, Default)]
struct Table(Rc<RefCell<Vec<u8>>>);

impl Write for Table {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

async fn beside(file: &[u8], changes: &[&str]) -> Result<(Comparison, String), String> {
    let (mut variation, table) = (Variation::default(), Table::default());
    changes.iter().for_each(|change| variation.changes.add(change).unwrap());
    variation.table = Some(Box::new(table.clone()));
    let replayed = replay_beside(|| Ok(file), None, variation).await?;
    assert_eq!((replayed.steps, &replayed.difference), (883, &None), "the first run is as it was");
    let text = String::from_utf8(table.0.take()).unwrap();
    Ok((replayed.comparison.unwrap(), text))
}

fn row<'a>(comparison: &'a Comparison, joint: &str) -> &'a Difference {
    comparison.rows.iter().find(|row| row.robot == "arm" && row.joint == joint).unwrap()
}

#[tokio::test]
async fn a_change_that_changes_nothing_comes_to_the_same() {
    let directory = tempfile::tempdir().unwrap();
    let file = fs::read(recorded(directory.path()).await).unwrap();
    let (comparison, table) = beside(&file, &["arm/elbow.gravity_compensation=off"]).await.unwrap();
    let names: Vec<_> = comparison.rows.iter().map(|row| (row.robot.as_str(), row.joint.as_str())).collect();
    assert_eq!(names, [("arm", "shoulder"), ("arm", "elbow"), ("ball", ""), ("ball_1", "")]);
    assert!(comparison.rows.iter().all(|row| row.largest == 0.0), "{comparison:?}");
    assert_eq!(comparison.refused, None);
    assert!(table.starts_with("time,robot,joint,recorded_position,position,"));
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|line| line.split(',').collect()).collect();
    // Two joints, 0.78 s of simulated time in total, a row each 10 ms.
    assert!((100..200).contains(&rows.len()), "{}", rows.len());
    assert!(
        rows.iter().all(|row| row.len() == 9 && row[3] == row[4] && row[5] == row[6] && row[7] == row[8])
    );
}

#[tokio::test]
async fn another_gain_or_time_step_differs_where_it_acts() {
    let directory = tempfile::tempdir().unwrap();
    let file = fs::read(recorded(directory.path()).await).unwrap();
    let (soft, _) = beside(&file, &["arm/elbow.stiffness=0.5", "arm/elbow.gain_damping=0.05"]).await.unwrap();
    assert!(row(&soft, "elbow").largest > 0.1, "{soft:?}");
    assert!(row(&soft, "elbow").rms() < row(&soft, "elbow").largest && row(&soft, "elbow").at > 0.03);
    let (fine, table) = beside(&file, &["time_step=0.0005"]).await.unwrap();
    assert!((1e-9..0.1).contains(&row(&fine, "elbow").largest), "{fine:?}");
    assert!(table.lines().count() > 100);
    assert_eq!(fine.changes, ["time_step=0.0005"]);
}

#[tokio::test]
async fn impossible_changes_are_reported() {
    let directory = tempfile::tempdir().unwrap();
    let file = fs::read(recorded(directory.path()).await).unwrap();
    let lost = beside(&file, &["arm/wrist.damping=1", "leg/knee.damping=1"]).await.unwrap_err();
    assert_eq!(lost, "no robot of the recording has the joint arm/wrist, leg/knee");
    let long = beside(&file, &["time_step=10"]).await.unwrap_err();
    assert!(long.starts_with("it cannot be changed: ") && long.contains("time_step"), "{long}");
}
