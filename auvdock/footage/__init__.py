"""Perception by itself on footage of one's own: images, videos and recordings in, a row a frame out."""
