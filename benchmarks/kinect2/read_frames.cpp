// Reads frames of the first Kinect v2 by libfreenect2, and writes depth and infrared as float32:
//
//     read_frames FOLDER COUNT FILTERS
//
// Beside them stands what the camera says of itself, as lines of text.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include <libfreenect2/frame_listener_impl.h>
#include <libfreenect2/libfreenect2.hpp>
#include <libfreenect2/packet_pipeline.h>

using libfreenect2::Frame;
using libfreenect2::Freenect2Device;

static const int kWithinMs = 600000;
static const float kFarthestM = 18.75f;  // beyond, ranges repeat

static void Save(const std::string &path, const Frame &frame) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char *>(frame.data), frame.width * frame.height * 4);
}

int main(int argc, char **argv) {
  if (argc != 4) return 2;
  const std::string folder = argv[1];
  const int count = std::atoi(argv[2]);
  libfreenect2::Freenect2 freenect2;
  if (freenect2.enumerateDevices() != 1) return 3;
  Freenect2Device *device = freenect2.openDevice(0, new libfreenect2::CpuPacketPipeline());
  if (device == nullptr) return 4;

  Freenect2Device::Config config;
  config.MaxDepth = kFarthestM;
  config.EnableBilateralFilter = config.EnableEdgeAwareFilter = std::atoi(argv[3]) != 0;
  device->setConfiguration(config);
  libfreenect2::SyncMultiFrameListener listener(Frame::Ir | Frame::Depth);
  device->setIrAndDepthFrameListener(&listener);
  if (!device->startStreams(false, true)) return 5;
  std::printf("%s %s\n", device->getSerialNumber().c_str(), device->getFirmwareVersion().c_str());

  for (int number = 0; number < count; number++) {
    libfreenect2::FrameMap frames;
    if (!listener.waitForNewFrame(frames, kWithinMs)) return 6;
    Save(folder + "/depth" + std::to_string(number), *frames[Frame::Depth]);
    Save(folder + "/ir" + std::to_string(number), *frames[Frame::Ir]);
    std::printf("%u\n", frames[Frame::Depth]->sequence);
    listener.release(frames);
  }
  return device->stop() && device->close() ? 0 : 7;
}
