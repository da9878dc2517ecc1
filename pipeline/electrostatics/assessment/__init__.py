"""What fields are judged by: error against run time, extreme settings."""
