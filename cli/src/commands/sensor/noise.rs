//! Noise as an argument: `linear-acceleration.z:deviation=0.02,bias=0.1`.

use simd_client::proto::{SensorChannel, SensorNoise};

/// Words before an equals sign.
const WORDS: &str = "deviation, bias, bias-deviation, walk, correlation-time, quantum or dropout";

/// Parses `CHANNEL[.AXIS]:WHAT=VALUE,...`.
pub(super) fn parse(text: &str) -> Result<SensorNoise, String> {
    let (channel, values) =
        text.split_once(':').ok_or_else(|| "must be CHANNEL[.AXIS]:WHAT=VALUE,...".to_owned())?;
    let (name, axis) = match channel.split_once('.') {
        Some((name, axis)) => (name, Some(axis)),
        None => (channel, None),
    };
    let axis = match axis {
        None => None,
        Some("x") => Some(0),
        Some("y") => Some(1),
        Some("z") => Some(2),
        Some(other) => return Err(format!("`{other}` is not an axis: x, y or z")),
    };
    let on_wire = format!("SENSOR_CHANNEL_{}", name.replace('-', "_").to_ascii_uppercase());
    let channel =
        SensorChannel::from_str_name(&on_wire).filter(|channel| *channel != SensorChannel::Unspecified);
    let channel = channel.ok_or_else(|| format!("`{name}` is not a channel: {}", channels()))?;
    let mut noise = SensorNoise { channel: channel.into(), axis, ..SensorNoise::default() };
    for pair in values.split(',') {
        let (what, value) = pair.split_once('=').ok_or_else(|| format!("`{pair}` must be WHAT=VALUE"))?;
        let value: f64 = value.parse().map_err(|_| format!("`{value}` is not a number"))?;
        match what {
            "deviation" => noise.standard_deviation = value,
            "bias" => noise.bias_mean = value,
            "bias-deviation" => noise.bias_standard_deviation = value,
            "walk" => noise.random_walk = value,
            "correlation-time" => noise.correlation_time = Some(value),
            "quantum" => noise.quantum = value,
            "dropout" => noise.dropout = value,
            _ => return Err(format!("`{what}` is not {WORDS}")),
        }
    }
    Ok(noise)
}

/// Lists the words of channels.
fn channels() -> String {
    let known = (1..).map_while(|number| SensorChannel::try_from(number).ok()).map(word);
    known.collect::<Vec<_>>().join(", ")
}

/// Returns the word of a channel.
pub(super) fn word(channel: SensorChannel) -> String {
    channel.as_str_name().trim_start_matches("SENSOR_CHANNEL_").replace('_', "-").to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_a_channel_and_what_is_wrong_with_it() {
        let noise = parse("linear-acceleration.z:deviation=0.02,bias=-0.1,correlation-time=300").unwrap();
        assert_eq!((noise.channel(), noise.axis), (SensorChannel::LinearAcceleration, Some(2)));
        assert_eq!((noise.standard_deviation, noise.bias_mean), (0.02, -0.1));
        assert_eq!(noise.correlation_time, Some(300.0));
        let lossy = parse("range:dropout=0.5,quantum=0.001").unwrap();
        assert_eq!((lossy.channel(), lossy.axis, lossy.dropout), (SensorChannel::Range, None, 0.5));
    }

    #[test]
    fn faults_are_named() {
        for (text, part) in [
            ("range", "CHANNEL"),
            ("sound:deviation=1", "`sound` is not a channel: linear-acceleration"),
            ("unspecified:deviation=1", "is not a channel"),
            ("range.w:deviation=1", "`w` is not an axis"),
            ("range:loudness=1", "`loudness` is not deviation"),
            ("range:deviation=much", "`much` is not a number"),
            ("range:deviation", "WHAT=VALUE"),
        ] {
            let refused = parse(text).unwrap_err();
            assert!(refused.contains(part), "{text}: {refused}");
        }
    }
}
