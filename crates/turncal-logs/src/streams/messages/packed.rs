//! Compressed records of a log.

use std::io::Read;

use crate::streams::bytes::{Broken, Input, most_at_once};

/// Unpacks a chunk at this offset of a file into `size` bytes by the method stated in the file.
pub fn unpack(
    method: &str,
    packed: &[u8],
    size: u64,
    offset: u64,
    file: &Input,
) -> Result<Vec<u8>, Broken> {
    let most = most_at_once(file.length());
    if size > most {
        return Err(Broken::new(
            offset,
            format_args!("a chunk of {size} bytes"),
            format_args!("at most {most} bytes"),
        ));
    }
    let mut unpacked = Vec::new();
    let broken = |error: &dyn std::fmt::Display| {
        Broken::new(
            offset,
            error,
            format_args!("a chunk compressed with {method}"),
        )
    };
    let read = match method {
        "" | "none" => {
            unpacked.extend_from_slice(packed);
            Ok(0)
        }
        "lz4" => {
            let decoder = lz4_flex::frame::FrameDecoder::new(packed);
            decoder.take(size + 1).read_to_end(&mut unpacked)
        }
        "zstd" => {
            let decoder =
                ruzstd::decoding::StreamingDecoder::new(packed).map_err(|error| broken(&error))?;
            decoder.take(size + 1).read_to_end(&mut unpacked)
        }
        "bz2" => bzip2_rs::DecoderReader::new(packed)
            .take(size + 1)
            .read_to_end(&mut unpacked),
        other => {
            return Err(Broken::new(
                offset,
                format_args!("a chunk compressed with `{other}`"),
                "no compression, lz4, zstd or bz2",
            ));
        }
    };
    read.map_err(|error| broken(&error))?;
    if unpacked.len() as u64 != size {
        return Err(Broken::new(
            offset,
            format_args!("{} bytes in a chunk", unpacked.len()),
            format_args!("{size} bytes, as its header states"),
        ));
    }
    Ok(unpacked)
}
