"""Control for paper C's landing: above the station, down between its guides, latched; see `modes` for the stages."""
