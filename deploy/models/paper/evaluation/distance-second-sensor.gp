set encoding utf8
set terminal pngcairo noenhanced size 960,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'distance-second-sensor.png'
set datafile separator comma
set title 'Error of the centre by distance, second sensor'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key top left
set xlabel 'distance [m]'
set ylabel 'error of the centre, fitted to the field alone [m]'
set logscale y
plot 'distance-second-sensor.csv' skip 1 every ::0::17 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'prior, median', \
     'distance-second-sensor.csv' skip 1 every ::18::35 using 2:3 with lines lw 2 lc rgb '#0072b2' dt 2 title 'prior, 90th percentile', \
     'distance-second-sensor.csv' skip 1 every ::36::53 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'first look, median', \
     'distance-second-sensor.csv' skip 1 every ::54::71 using 2:3 with lines lw 2 lc rgb '#d55e00' dt 2 title 'first look, 90th percentile'
