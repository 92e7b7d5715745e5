"""Points without an image, from LiDAR sweeps and finished maps, to the stairs in them."""
