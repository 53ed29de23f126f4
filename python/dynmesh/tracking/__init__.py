"""What tracking and registration of files share: scans, landmarks, rooms, and how well they fit."""
