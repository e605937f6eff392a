//! Pictures of the world: requests for them, and calls of renderers.

use std::io::Read as _;
use std::time::Duration;

use flate2::bufread::ZlibDecoder;
use simd_proto::v1::{
    CameraPicture, GetMeshRequest, GetPictureRequest, ListCamerasRequest, ListCamerasResponse,
    NextPictureRequest, PictureMoment, PicturePlane, PictureTask, PlaneCompression, PutPictureRequest,
    TakePictureRequest,
};

use crate::{Client, Error, client::present};

/// Default time that the daemon waits for a picture.
const PICTURE: Duration = Duration::from_secs(10);

/// `CameraService`.
impl Client {
    /// Returns the cameras of robots, and the active renderers.
    ///
    /// # Errors
    /// As every call.
    pub async fn list_cameras(&self) -> Result<ListCamerasResponse, Error> {
        self.unary(self.camera_service().list_cameras(ListCamerasRequest {})).await
    }

    /// Returns a picture of a robot's camera, of the present state or a later one. An empty `sensor` is the
    /// only camera of the robot.
    ///
    /// # Errors
    /// `NO_RENDERER`, `PICTURE_TIMEOUT`, `PICTURE_FAILED`, `ROBOT_NOT_FOUND`, `SENSOR_NOT_FOUND`,
    /// `LIMIT_EXCEEDED`.
    pub async fn picture(&self, robot: &str, sensor: &str) -> Result<CameraPicture, Error> {
        let (robot, sensor) = (robot.to_owned(), sensor.to_owned());
        self.get_picture(GetPictureRequest { robot, sensor, ..Default::default() }).await
    }

    /// Returns the first picture at a camera's own rate after a sequence; 0 gives any of the last second. The
    /// camera is followed for five seconds.
    ///
    /// # Errors
    /// As [`picture`](Self::picture).
    pub async fn next_camera_picture(
        &self,
        robot: &str,
        sensor: &str,
        after_sequence: u64,
    ) -> Result<CameraPicture, Error> {
        let (robot, sensor) = (robot.to_owned(), sensor.to_owned());
        let moment = PictureMoment::Next.into();
        self.get_picture(GetPictureRequest { robot, sensor, moment, after_sequence, ..Default::default() })
            .await
    }

    /// Returns a picture of a robot's camera, as the request says.
    ///
    /// # Errors
    /// As [`picture`](Self::picture), and `INVALID_VALUE`.
    pub async fn get_picture(&self, request: GetPictureRequest) -> Result<CameraPicture, Error> {
        let longer = time_limit(request.timeout);
        let answer = self.unary_for(longer, self.camera_service().get_picture(request)).await?;
        present(answer.picture, "picture")
    }

    /// Returns a picture of the present state from any point of view.
    ///
    /// # Errors
    /// `NO_RENDERER`, `PICTURE_TIMEOUT`, `PICTURE_FAILED`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn take_picture(&self, request: TakePictureRequest) -> Result<CameraPicture, Error> {
        let longer = time_limit(request.timeout);
        let answer = self.unary_for(longer, self.camera_service().take_picture(request)).await?;
        present(answer.picture, "picture")
    }

    /// For renderers: returns the next picture to draw, waiting at most `timeout` for it.
    ///
    /// # Errors
    /// `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn next_picture(
        &self,
        renderer: &str,
        timeout: Duration,
    ) -> Result<Option<PictureTask>, Error> {
        let request = NextPictureRequest { renderer: renderer.to_owned(), timeout: timeout.as_secs_f64() };
        Ok(self.unary_for(timeout, self.camera_service().next_picture(request)).await?.task)
    }

    /// For renderers: delivers a picture, or the reason why it was not drawn. Returns whether a client still
    /// waits for it.
    ///
    /// # Errors
    /// `INVALID_VALUE` if the picture does not match the task.
    pub async fn put_picture(&self, picture: PutPictureRequest) -> Result<bool, Error> {
        Ok(self.unary(self.camera_service().put_picture(picture)).await?.accepted)
    }

    /// Returns a mesh that a robot's visuals use, as binary glTF.
    ///
    /// # Errors
    /// `ASSET_NOT_UPLOADED`.
    pub async fn mesh(&self, sha256: &str) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::new();
        loop {
            let (sha256, offset) = (sha256.to_owned(), bytes.len() as u64);
            let request = GetMeshRequest { sha256, offset, max_bytes: 0 };
            let part = self.unary(self.camera_service().get_mesh(request)).await?;
            let is_last = bytes.len() as u64 + part.data.len() as u64 >= part.total_bytes;
            if part.data.is_empty() && !is_last {
                return Err(Error::Answer { reason: "a mesh's part is empty".to_owned() });
            }
            bytes.extend_from_slice(&part.data);
            if is_last {
                return Ok(bytes);
            }
        }
    }
}

fn time_limit(timeout: f64) -> Duration {
    match timeout == 0.0 {
        true => PICTURE,
        false => Duration::try_from_secs_f64(timeout).unwrap_or(PICTURE),
    }
}

/// Returns the numbers of a picture's plane, as bytes.
///
/// # Errors
/// Returns an error if the plane does not have the picture's size, or has a compression that this client does
/// not know.
pub fn plane_bytes(
    picture: &CameraPicture,
    plane: &PicturePlane,
    bytes_of_pixel: u64,
) -> Result<Vec<u8>, Error> {
    let refuse = |reason: String| Error::Answer { reason };
    let expected = u64::from(picture.width) * u64::from(picture.height) * bytes_of_pixel;
    let bytes = match PlaneCompression::try_from(plane.compression) {
        Ok(PlaneCompression::Unspecified) => plane.data.clone(),
        Ok(PlaneCompression::Zlib) => {
            let mut bytes = Vec::new();
            let mut decoder = ZlibDecoder::new(&*plane.data).take(expected.saturating_add(1));
            decoder
                .read_to_end(&mut bytes)
                .map_err(|error| refuse(format!("a plane of a picture is broken: {error}")))?;
            bytes
        }
        Err(_unknown) => return Err(refuse("a plane of a picture is packed in an unknown way".to_owned())),
    };
    match bytes.len() as u64 == expected {
        true => Ok(bytes),
        false => Err(refuse(format!(
            "a plane of a picture is not of {} x {} pixels",
            picture.width, picture.height
        ))),
    }
}
