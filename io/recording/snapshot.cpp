#include "io/recording/snapshot.h"

#include "io/recording/reader.h"
#include "io/recording/writer.h"

namespace shiftrig::io {

void write_snapshot(const std::string& path, const Manifest& manifest) {
    RecordingWriter writer(path);
    writer.begin(manifest);
    const auto summary = writer.end();
    if (!summary.error.empty()) throw RecordingError(summary.error);
}

Manifest read_snapshot(const std::string& path) {
    RecordingReader reader(path);
    if (reader.manifest().assembly.empty())
        throw RecordingError(
            path + ": is a recording, not a snapshot; `shiftrig run --snapshot-at T FILE` makes one");
    RecordedTick tick;
    if (reader.next(tick) || reader.ending() != Ending::complete) throw RecordingError(reader.complaint());
    return reader.manifest();
}

}  // namespace shiftrig::io
