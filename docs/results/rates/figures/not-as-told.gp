set encoding utf8
set terminal pngcairo noenhanced size 1200,600 font 'DejaVu Sans,11' background '#ffffff'
set output 'not-as-told.png'
set datafile separator comma
set title 'Through a rate loop: not-as-told'
set border 3 lc rgb '#505050'
set tics nomirror
set grid back lc rgb '#dddddd' lt 1
set key outside right top
set xlabel 'speed limit [m/s]'
set xrange [7.2:8.8]
set ylabel 'races won [%]'
set yrange [0:105]
plot 'not-as-told.csv' skip 1 every ::0::0 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#0072b2' title 'rate loop 1.5 times as slow as told', \
     'not-as-told.csv' skip 1 every ::0::0 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#0072b2' notitle, \
     'not-as-told.csv' skip 1 every ::1::1 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#d55e00' title 'rate loop quicker than told, 0.67 of its time', \
     'not-as-told.csv' skip 1 every ::1::1 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#d55e00' notitle, \
     'not-as-told.csv' skip 1 every ::2::2 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#009e73' title '20 ms from setpoint to rate loop', \
     'not-as-told.csv' skip 1 every ::2::2 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#009e73' notitle, \
     'not-as-told.csv' skip 1 every ::3::3 using 2:3 with linespoints lw 2 pt 7 ps 0.9 lc rgb '#cc79a7' title 'thrust 10 % stronger than told', \
     'not-as-told.csv' skip 1 every ::3::3 using 2:3:4:5 with yerrorbars lw 1.3 pt 7 ps 0 lc rgb '#cc79a7' notitle
