//! Serde representations of other crates' types, as plain numbers.

/// `x y z`.
pub(crate) mod vector3 {
    use glamx::DVec3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(vector: &DVec3, serializer: S) -> Result<S::Ok, S::Error> {
        vector.to_array().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DVec3, D::Error> {
        <[f64; 3]>::deserialize(deserializer).map(DVec3::from_array)
    }
}

/// `x y z`, twice.
pub(crate) mod two_vectors3 {
    use glamx::DVec3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(vectors: &[DVec3; 2], serializer: S) -> Result<S::Ok, S::Error> {
        vectors.map(|vector| vector.to_array()).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[DVec3; 2], D::Error> {
        <[[f64; 3]; 2]>::deserialize(deserializer).map(|vectors| vectors.map(DVec3::from_array))
    }
}

/// `x y z` and a quaternion `x y z w`.
pub(crate) mod pose3 {
    use glamx::{DPose3, DQuat, DVec3};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(pose: &DPose3, serializer: S) -> Result<S::Ok, S::Error> {
        (pose.translation.to_array(), pose.rotation.to_array()).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DPose3, D::Error> {
        let (translation, rotation) = <([f64; 3], [f64; 4])>::deserialize(deserializer)?;
        Ok(DPose3::from_parts(DVec3::from_array(translation), DQuat::from_array(rotation)))
    }
}

/// `x y z w`.
pub(crate) mod quaternion {
    use glamx::DQuat;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(quaternion: &DQuat, serializer: S) -> Result<S::Ok, S::Error> {
        quaternion.to_array().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<DQuat, D::Error> {
        <[f64; 4]>::deserialize(deserializer).map(DQuat::from_array)
    }
}

/// `x y z`, or nothing.
pub(crate) mod optional_vector3 {
    use glamx::DVec3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(vector: &Option<DVec3>, serializer: S) -> Result<S::Ok, S::Error> {
        vector.map(|vector| vector.to_array()).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Option<DVec3>, D::Error> {
        Ok(Option::<[f64; 3]>::deserialize(deserializer)?.map(DVec3::from_array))
    }
}

/// `x y z` twice, or nothing.
pub(crate) mod optional_two_vectors3 {
    use glamx::DVec3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        vectors: &Option<(DVec3, DVec3)>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        vectors.map(|(one, other)| [one.to_array(), other.to_array()]).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<(DVec3, DVec3)>, D::Error> {
        let vectors = Option::<[[f64; 3]; 2]>::deserialize(deserializer)?;
        Ok(vectors.map(|[one, other]| (DVec3::from_array(one), DVec3::from_array(other))))
    }
}

/// A pose as in [`pose3`], or nothing.
pub(crate) mod optional_pose3 {
    use glamx::DPose3;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    struct Pose(#[serde(with = "super::pose3")] DPose3);

    pub(crate) fn serialize<S: Serializer>(pose: &Option<DPose3>, serializer: S) -> Result<S::Ok, S::Error> {
        pose.map(Pose).serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<DPose3>, D::Error> {
        Ok(Option::<Pose>::deserialize(deserializer)?.map(|Pose(pose)| pose))
    }
}

/// A shared value, written as the value.
pub(crate) mod shared {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<T: Serialize, S: Serializer>(
        shared: &Arc<T>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        T::serialize(shared, serializer)
    }

    pub(crate) fn deserialize<'de, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<T>, D::Error> {
        T::deserialize(deserializer).map(Arc::new)
    }
}

/// A text that may be absent.
pub(crate) mod optional_text {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(crate) fn serialize<S: Serializer>(
        text: &Option<Arc<str>>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        text.as_deref().serialize(serializer)
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Option<Arc<str>>, D::Error> {
        Option::<&str>::deserialize(deserializer).map(|text| text.map(Arc::from))
    }
}

/// A shared list with a maximum number of entries.
pub(crate) mod shared_list {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer};

    pub(crate) fn deserialize<'de, const MAX: usize, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Arc<Vec<T>>, D::Error> {
        super::bounded_list::deserialize::<MAX, T, D>(deserializer).map(Arc::new)
    }
}

/// A list with a maximum number of entries.
pub(crate) mod bounded_list {
    use std::fmt;
    use std::marker::PhantomData;

    use serde::de::{Error as _, SeqAccess, Visitor};
    use serde::{Deserialize, Deserializer};

    pub(crate) fn deserialize<'de, const MAX: usize, T: Deserialize<'de>, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<T>, D::Error> {
        deserializer.deserialize_seq(Bounded::<MAX, T>(PhantomData))
    }

    struct Bounded<const MAX: usize, T>(PhantomData<T>);

    impl<'de, const MAX: usize, T: Deserialize<'de>> Visitor<'de> for Bounded<MAX, T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "a list of at most {MAX} entries")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
            let mut entries = Vec::new();
            while let Some(entry) = list.next_element()? {
                if entries.len() == MAX {
                    return Err(A::Error::custom(format_args!("a list has more than {MAX} entries")));
                }
                entries.push(entry);
            }
            Ok(entries)
        }
    }
}
