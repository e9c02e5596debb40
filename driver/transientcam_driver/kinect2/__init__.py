"""Microsoft Kinect v2: three fixed frequencies over USB 3 (docs/cameras.md, docs/kinect2.md).

``packets`` finds sub-images in the packets of the isochronous endpoint, ``codes`` decodes them,
``measurement`` puts them in the order of a frame, ``tables`` and ``parameters`` read what the
camera knows about itself; ``encoder`` goes the other way. All of these are pure. The bytes are
those that OpenKinect/libfreenect2 accepts.
"""
