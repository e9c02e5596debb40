"""The decoder and the estimators of a Kinect v2 beside libfreenect2's."""
