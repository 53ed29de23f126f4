"""What tracking and registration share: scans, landmarks, the background, and how well they fit."""
